// Names of models and backends in the options of a job, and the check that this server has them.
// Stateless.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/store/user_models.h"

namespace color3d {

struct NameUse {
  std::string field;  // as a client writes it
  std::string name;
};

struct SpecNames {
  std::vector<NameUse> models;
  std::vector<NameUse> backends;
};

SpecNames NamesIn(const v1::JobSpec& spec);

// Throws ServiceError{kInvalidArgument, UNKNOWN_MODEL or UNKNOWN_BACKEND} with the field, the name,
// the known names and the remedy.
void CheckNames(const v1::JobSpec& spec, const UserModels& models);

}  // namespace color3d
