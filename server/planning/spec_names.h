// The names of models and backends in a job's options: which there are, and whether this server has
// them.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/store/user_models.h"

namespace color3d {

struct NameUse {
  std::string field;  // as a client would write it
  std::string name;
};

struct SpecNames {
  std::vector<NameUse> models;
  std::vector<NameUse> backends;
};

SpecNames NamesIn(const v1::JobSpec& spec);

// Throws ServiceError{kInvalidArgument, UNKNOWN_MODEL or UNKNOWN_BACKEND} with the field, the name,
// the names that there are and how to add one.
void CheckNames(const v1::JobSpec& spec, const UserModels& models);

}  // namespace color3d
