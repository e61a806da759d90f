// color3d-bench stability: stiff and extreme cases of all parts of the method, compared with
// float64.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/bench/commands.h"
#include "tests/stability/stability_case.h"
#include "tests/stability/stability_table.h"

namespace color3d {
namespace {

struct StabilityArguments {
  std::string json_file;
  std::string markdown_file;
  std::string only;
  bool fast = false;
  int threads = 2;
};

std::string Number(double value) {
  if (std::isnan(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof(text), "%.1e", value);
  return text;
}

void PrintRow(const StabilityCase& c, const StabilityResult& r) {
  std::printf("%-9s %-38s %8s %-28s %8s %8s %8s %8s %4lld %5lld %6.2f %s %s\n",
              c.group.c_str(),
              c.name.c_str(),
              r.condition_of == "-" ? "-" : Number(r.condition).c_str(),
              r.condition_of.c_str(),
              Number(r.value_error).c_str(),
              std::isnan(r.value_error) ? "-" : Number(r.value_bound).c_str(),
              Number(r.gradient_error).c_str(),
              std::isnan(r.gradient_error) ? "-" : Number(r.gradient_bound).c_str(),
              static_cast<long long>(r.non_finite),
              static_cast<long long>(r.left_out),
              r.seconds,
              r.Passed() ? "ok  " : "FAIL",
              r.outcome.c_str());
  std::fflush(stdout);
}

// JSON has neither infinity nor NaN.
nlohmann::ordered_json OrNull(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

nlohmann::ordered_json ToJson(const StabilityCase& c, const StabilityResult& r) {
  return {{"group", c.group},
          {"case", c.name},
          {"condition_of", r.condition_of},
          {"condition", OrNull(r.condition)},
          {"value_error", OrNull(r.value_error)},
          {"value_bound", OrNull(r.value_bound)},
          {"gradient_error", OrNull(r.gradient_error)},
          {"gradient_bound", OrNull(r.gradient_bound)},
          {"non_finite", r.non_finite},
          {"compared", r.compared},
          {"left_out", r.left_out},
          {"restores", r.restores},
          {"outcome", r.outcome},
          {"seconds", r.seconds},
          {"passed", r.Passed()}};
}

void RunStability(const StabilityArguments& args) {
  ThreadPool pool(args.threads);
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  std::vector<StabilityRow> table;
  int failed = 0;
  std::printf("%-9s %-38s %8s %-28s %8s %8s %8s %8s %4s %5s %6s\n",
              "group",
              "case",
              "cond.",
              "of",
              "value",
              "bound",
              "gradient",
              "bound",
              "bad",
              "out",
              "s");
  for (const StabilityCase& c : StabilityCases()) {
    if ((args.fast && c.slow) || (c.group + ", " + c.name).find(args.only) == std::string::npos) {
      continue;
    }
    const StabilityResult r = RunStabilityCase(c, pool);
    PrintRow(c, r);
    rows.push_back(ToJson(c, r));
    table.push_back({c, r});
    failed += r.Passed() ? 0 : 1;
  }
  if (!args.json_file.empty()) {
    WriteFileAtomic(args.json_file,
                    nlohmann::ordered_json{{"cases", rows}, {"failed", failed}}.dump(1) + "\n");
  }
  if (!args.markdown_file.empty()) WriteFileAtomic(args.markdown_file, StabilityMarkdown(table));
  if (failed > 0) {
    throw Error(ErrorCode::kInternal, "{} stability cases failed", failed);
  }
}

}  // namespace

void AddStabilityCommand(CLI::App& app) {
  auto args = std::make_shared<StabilityArguments>();
  CLI::App* command =
      app.add_subcommand("stability", "Run stiff and extreme cases of all parts of the method");
  command->add_option("--only", args->only, "Only cases whose \"group, name\" contains this");
  command->add_flag("--fast", args->fast, "Skip slow cases");
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command
      ->add_option(
          "--markdown", args->markdown_file, "File for the table that is committed (Markdown)")
      ->excludes("--only")
      ->excludes("--fast");
  command->callback([args] { RunStability(*args); });
}

}  // namespace color3d
