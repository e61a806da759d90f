#include "server/ops/scale_command.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/process/subprocess.h"
#include "core/base/text/utf8.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kEndOfOutput = 4096;  // bytes
constexpr size_t kLongestLine = 300;    // bytes
// Exit statuses of shells.
constexpr int kNotExecutable = 126, kNotFound = 127;

// Returns the last line that is not blank, for a log; empty if there is none.
std::string LastLine(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  const int64_t size = stream.tellg();
  if (size <= 0) return "";
  const int64_t start = std::max<int64_t>(0, size - kEndOfOutput);
  std::string text(static_cast<size_t>(size - start), '\0');
  stream.seekg(start);
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  const size_t end = text.find_last_not_of(" \t\r\n");
  if (end == std::string::npos) return "";
  text.resize(end + 1);
  return EscapeControls(CleanUtf8(text.substr(text.find_last_of('\n') + 1), kLongestLine));
}

}  // namespace

void CheckScaleCommand(const fs::path& program) {
  if (!program.is_absolute()) {
    throw InvalidArgument(
        "--scale-command is '{}'; give the absolute path of a program, which is run with the "
        "number "
        "of workers as its only argument",
        program.string());
  }
  std::error_code error;
  if (!fs::is_regular_file(program, error) || ::access(program.c_str(), X_OK) != 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot run {} of --scale-command; it must be a file that this user may execute "
                "(chmod +x)",
                program.string());
  }
}

ScaleCommand::ScaleCommand(ScaleCommandOptions options, Demand demand)
    : options_(std::move(options)), demand_(std::move(demand)) {
  thread_ = std::thread([this] { Loop(); });
}

ScaleCommand::~ScaleCommand() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  cancel_.Cancel();
  wake_.NotifyAll();
  thread_.join();
}

void ScaleCommand::Loop() {
  while (true) {
    try {
      Look();
    } catch (const std::exception& e) {
      if (cancel_.IsCancelled()) return;
      if (problem_ != e.what()) spdlog::warn("--scale-command waits: {}", e.what());
      problem_ = e.what();
    }
    const MutexLock lock(mutex_);
    const auto end = Steady::now() + options_.poll;
    while (!stopping_ && wake_.WaitUntil(mutex_, end)) continue;
    if (stopping_) return;
  }
}

void ScaleCommand::Look() {
  const std::optional<int64_t> demand = demand_();
  if (!demand) {
    told_.reset();  // another server tells another number meanwhile
    return;
  }
  const int64_t workers = std::clamp<int64_t>(*demand, 0, options_.max_workers);
  const auto now = Steady::now();
  if (now < next_run_) return;
  if (told_ == workers && (workers == 0 || now < next_repeat_)) return;
  const std::string problem = Run(workers);
  if (problem.empty()) {
    OnSuccess(workers);
  } else {
    OnFailure(workers, problem);
  }
}

std::string ScaleCommand::Run(int64_t workers) {
  std::error_code ignored;
  fs::remove(options_.output, ignored);
  SubprocessOptions run;
  run.arguments = {options_.program.string(), fmt::to_string(workers)};
  run.log_path = options_.output;
  run.timeout = options_.time_limit;
  try {
    CheckScaleCommand(options_.program);  // may have been removed since the start
    const SubprocessResult result = RunSubprocess(run, cancel_);
    if (result.exit_code == 0) return "";
    return Explain(result.exit_code, result.timed_out);
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kCancelled) throw;
    return e.what();
  }
}

std::string ScaleCommand::Explain(int exit_code, bool timed_out) const {
  const std::string said = LastLine(options_.output);
  const std::string last = said.empty() ? "it printed nothing" : "it printed: " + said;
  if (timed_out) {
    return fmt::format(
        "it did not end within {} s and was killed; it must hand the request over and return ({})",
        options_.time_limit.count(),
        last);
  }
  if (exit_code == kNotFound && said.empty()) {
    return "it cannot be executed; a script must begin with its interpreter (#!/bin/sh)";
  }
  if (exit_code == kNotFound || exit_code == kNotExecutable) {
    return fmt::format("exit status {}: a program that it names is missing; use whole paths ({})",
                       exit_code,
                       last);
  }
  return fmt::format("exit status {}; run it by hand as this user ({}; all of it is in {})",
                     exit_code,
                     last,
                     options_.output.string());
}

void ScaleCommand::OnSuccess(int64_t workers) {
  if (told_ != workers) {
    spdlog::info("{} was told that {} workers are wanted", options_.program.string(), workers);
  } else if (!problem_.empty()) {
    spdlog::info("{} works again", options_.program.string());
  }
  told_ = workers;
  failures_ = 0;
  problem_.clear();
  const auto now = Steady::now();
  next_run_ = now + options_.pause;
  next_repeat_ = now + std::max(options_.repeat, options_.pause);
}

void ScaleCommand::OnFailure(int64_t workers, const std::string& problem) {
  failures_ = std::min(failures_ + 1, 20);
  const auto pause =
      std::min(options_.pause * (int64_t{1} << (failures_ - 1)), options_.max_backoff);
  next_run_ = Steady::now() + pause;
  if (problem == problem_) return;  // logged
  problem_ = problem;
  spdlog::error(
      "{} {} failed: {}; it is tried again after {} s, then less often; jobs wait for workers",
      options_.program.string(),
      workers,
      problem,
      std::chrono::duration_cast<std::chrono::seconds>(pause).count());
}

}  // namespace color3d
