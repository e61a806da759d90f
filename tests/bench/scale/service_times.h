// Times of the job stores, for the simulation.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/bench/scale/queue_model.h"

namespace color3d {

// Of "sqlite", measured on the machine of deploy/SCALING.md with the database in memory: the time
// in which a disk syncs a write comes on top. Of "postgresql" they are assumed. Throws
// Error{kInvalidArgument} for another name.
ServiceTimes TimesOfDatabase(const std::string& database);

// Milliseconds of each time.
nlohmann::ordered_json TimesToJson(const ServiceTimes& times);
// Reads the object "service_ms" of a result of `color3d-bench store`; times that it lacks are those
// of `base`. Throws Error{kInvalidArgument} for a file without the object or with another name or
// value in it.
ServiceTimes ReadTimes(const std::filesystem::path& file, ServiceTimes base);

}  // namespace color3d
