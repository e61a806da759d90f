#include "server/planning/stage_key.h"

#include "server/planning/job_spec.h"
#include "server/planning/spec_check.h"
#include "server/planning/spec_names.h"

namespace color3d {

StageKeyPart KeyPartOf(v1::JobSpec spec) {
  StageKeyPart part;
  if (spec.has_colorize_scene() || spec.has_personalize_scenes()) return part;
  // The name of the scene does not count: equal files give equal results.
  spec.clear_scene();
  spec.clear_inputs();
  spec.clear_skip_cache();
  part.bytes = KindOf(spec) + '\n' + DeterministicBytes(spec);
  const SpecNames names = NamesIn(spec);
  for (const NameUse& use : names.models) part.models.push_back(use.name);
  for (const NameUse& use : names.backends) part.backends.push_back(use.name);
  return part;
}

}  // namespace color3d
