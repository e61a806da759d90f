// color3d-bench store: times of the calls of workers on a store with a long history and queue.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/bench/scale/service_times.h"
#include "tests/bench/scale/store_times.h"

namespace color3d {
namespace {

struct StoreArguments {
  StoreLoad load;
  double most_claim_ms = 0.0;
  std::string json_file;
};

nlohmann::ordered_json CallsToJson(const StoreTimes& times) {
  nlohmann::ordered_json calls;
  for (const CallTimes& call : times.calls) {
    calls[call.call] = {{"calls", call.calls},
                        {"p50_ms", call.p50},
                        {"p99_ms", call.p99},
                        {"max_ms", call.most},
                        {"cpu_p50_ms", call.cpu_p50},
                        {"cpu_p99_ms", call.cpu_p99}};
  }
  return calls;
}

void RunStore(const StoreArguments& args) {
  const StoreTimes times = MeasureStore(args.load);
  // The CPU of the server is measured by color3d-bench queue.
  nlohmann::ordered_json service = TimesToJson(times.service);
  service.erase("call_cpu");
  WriteResult({{"database", args.load.database},
               {"finished", args.load.finished},
               {"queued", args.load.queued},
               {"filling_s", times.filling_seconds},
               {"calls", CallsToJson(times)},
               {"service_ms", service}},
              args.json_file);
  for (const CallTimes& call : times.calls) {
    if (call.call != "Claim" || args.most_claim_ms <= 0.0) continue;
    if (call.p99 < args.most_claim_ms) continue;
    throw Error(ErrorCode::kFailedPrecondition,
                "the 99th percentile of a claim is {:.1f} ms; the limit is {} ms",
                call.p99,
                args.most_claim_ms);
  }
}

}  // namespace

void AddStoreCommand(CLI::App& app) {
  auto args = std::make_shared<StoreArguments>();
  StoreLoad& load = args->load;
  CLI::App* command = app.add_subcommand(
      "store", "Time the calls of workers on a job store with a long history and queue");
  const auto add = [command](const char* flag, auto& value, const char* text) {
    return command->add_option(flag, value, text)->capture_default_str();
  };
  add("--database", load.database, "Kind of store; postgresql: a private server")
      ->check(CLI::IsMember({"sqlite", "postgresql"}));
  add("--finished", load.finished, "Finished jobs in the store")
      ->check(CLI::Range(int64_t{0}, int64_t{100'000'000}));
  add("--queued", load.queued, "Queued jobs")->check(CLI::Range(int64_t{1}, int64_t{10'000'000}));
  add("--claims", load.claims, "Claims by one caller, and again by all at once")
      ->check(CLI::Range(1, 1'000'000));
  add("--callers", load.callers, "Callers at once")->check(CLI::Range(1, 1000));
  add("--projects", load.projects, "Projects of the jobs")->check(CLI::Range(1, 10'000));
  add("--max-claim-ms", args->most_claim_ms, "Fail above this 99th percentile of a claim; 0: never")
      ->check(CLI::Range(0.0, 1e6));
  command->add_option("--json", args->json_file, "File for the result; default: standard output");
  command->callback([args] { RunStore(*args); });
}

}  // namespace color3d
