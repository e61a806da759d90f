#include "server/planning/spec_names.h"

#include "proto/option_text.h"
#include "server/base/service_error.h"
#include "server/planning/spec_values.h"

namespace color3d {
namespace {

template <typename Value>
void Require(const std::vector<NameUse>& uses,
             const std::map<std::string, Value>& known,
             const std::string& what,
             ErrorReason reason,
             const std::string& remedy) {
  for (const NameUse& use : uses) {
    if (known.contains(use.name)) continue;
    const std::string why = fmt::format(
        " names the {} '{}', which this server does not have (it has: {}); start it with {}",
        what,
        use.name,
        NamesOf(known),
        remedy);
    throw ServiceError(reason, use.field + why, {{use.field, use.field + why}});
  }
}

}  // namespace

SpecNames NamesIn(const v1::JobSpec& spec) {
  SpecNames names;
  ForEachValue(spec, [&](const SpecValue& value) {
    const v1::OptionInfo::Names kind = InfoOf(value.field).names();
    if (kind == v1::OptionInfo::NAMES_UNSPECIFIED) return;
    const std::string name = value.owner.GetReflection()->GetString(value.owner, value.field);
    if (name.empty()) return;
    (kind == v1::OptionInfo::NAMES_MODEL ? names.models : names.backends)
        .push_back({value.path, name});
  });
  return names;
}

void CheckNames(const v1::JobSpec& spec, const UserModels& models) {
  const SpecNames names = NamesIn(spec);
  Require(names.models, models.files, "model", ErrorReason::kUnknownModel, "--model NAME=FILE");
  Require(names.backends,
          models.backends,
          "backend",
          ErrorReason::kUnknownBackend,
          "--backend NAME=ADDRESS");
}

}  // namespace color3d
