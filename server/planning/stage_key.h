// What a job's options contribute to the key of the stage cache.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"

namespace color3d {

struct StageKeyPart {
  // Of the kind, its options and the seed: equal bytes, equal work. Empty when the job must not be
  // served from the cache or found in it (the report of a graph).
  std::string bytes;
  // What the bytes name without saying what it is: the caller adds the files' digests and the
  // backends' addresses, so that other weights under an old name are other work.
  std::vector<std::string> models;
  std::vector<std::string> backends;
};

StageKeyPart KeyPartOf(v1::JobSpec spec);

}  // namespace color3d
