#include "tests/bench/scale/service_times.h"

#include <algorithm>
#include <iterator>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

struct TimeField {
  const char* name;
  double ServiceTimes::*member;
};

constexpr TimeField kTimeFields[] = {{"claim_read", &ServiceTimes::claim_read},
                                     {"prepare_read", &ServiceTimes::prepare_read},
                                     {"claim_write", &ServiceTimes::claim_write},
                                     {"join_write", &ServiceTimes::join_write},
                                     {"publish_write", &ServiceTimes::publish_write},
                                     {"artifact_write", &ServiceTimes::artifact_write},
                                     {"heartbeat_write", &ServiceTimes::heartbeat_write},
                                     {"worker_write", &ServiceTimes::worker_write},
                                     {"checkpoint_write", &ServiceTimes::checkpoint_write},
                                     {"call_cpu", &ServiceTimes::call_cpu}};

// A core hashes and sends about a gigabyte a second.
constexpr double kByteCpu = 1e-9;

}  // namespace

ServiceTimes TimesOfDatabase(const std::string& database) {
  ServiceTimes times;
  times.byte_cpu = kByteCpu;
  times.call_cpu = 1.2e-3;
  if (database == "sqlite") {
    times.claim_read = 0.19e-3;
    times.prepare_read = 0.48e-3;
    times.claim_write = 0.77e-3;
    times.join_write = 0.14e-3;
    times.publish_write = 0.66e-3;
    times.artifact_write = 0.026e-3;
    times.heartbeat_write = 0.21e-3;
    times.worker_write = 0.09e-3;
    times.checkpoint_write = 0.12e-3;
  } else if (database == "postgresql") {
    times.claim_read = 10e-3;
    times.prepare_read = 2e-3;
    times.claim_write = 4e-3;
    times.join_write = 2e-3;
    times.publish_write = 4e-3;
    times.artifact_write = 0.3e-3;
    times.heartbeat_write = 1e-3;
    times.worker_write = 0.7e-3;
    times.checkpoint_write = 2e-3;
  } else {
    throw InvalidArgument("there is no database '{}'; name sqlite or postgresql", database);
  }
  return times;
}

nlohmann::ordered_json TimesToJson(const ServiceTimes& times) {
  nlohmann::ordered_json json;
  for (const TimeField& field : kTimeFields) json[field.name] = 1e3 * times.*(field.member);
  return json;
}

ServiceTimes ReadTimes(const std::filesystem::path& file, ServiceTimes base) {
  const auto json = nlohmann::json::parse(ReadFile(file), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("service_ms") || !json["service_ms"].is_object()) {
    throw InvalidArgument("{} has no object \"service_ms\"; write it by color3d-bench store --json",
                          file.string());
  }
  for (const auto& [name, value] : json["service_ms"].items()) {
    const auto field = std::ranges::find_if(
        kTimeFields, [&name = name](const TimeField& known) { return name == known.name; });
    if (field == std::end(kTimeFields) || !value.is_number() || value.get<double>() < 0.0) {
      throw InvalidArgument(
          "{}: service_ms.{} is no known time of 0 ms or more", file.string(), name);
    }
    base.*(field->member) = 1e-3 * value.get<double>();
  }
  return base;
}

}  // namespace color3d
