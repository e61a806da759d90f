// The part of the key of the stage cache that depends on the options of a job. Stateless.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"

namespace color3d {

struct StageKeyPart {
  // From the kind, its options and the seed: equal bytes, equal work. Empty if the job is not
  // cached (the report of a graph).
  std::string bytes;
  // Names in the options. The caller adds digests of the files and addresses of the backends, so
  // that other weights under the same name are other work.
  std::vector<std::string> models;
  std::vector<std::string> backends;
};

StageKeyPart KeyPartOf(v1::JobSpec spec);

}  // namespace color3d
