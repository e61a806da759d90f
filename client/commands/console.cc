#include "client/commands/console.h"

#include <fmt/core.h>
#include <google/protobuf/util/json_util.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "client/lib/rpc_error.h"
#include "core/base/error.h"
#include "core/base/text/utf8.h"

namespace color3d::client {
namespace {

constexpr size_t kMaxViolations = 10;

void PrintError(const Context& context, const std::string& code, const std::string& message) {
  if (message.empty()) return;
  std::cerr << "color3d: " << EscapeControls(message, Lines::kMany) << std::endl;
  if (context.json) PrintJson({{"error", {{"code", code}, {"message", message}}}});
}

// The message of a server already names the first violations: they are listed only if there are
// more.
std::string WithViolations(const RpcError& error) {
  std::string text = error.what();
  const auto& violations = error.violations();
  if (violations.size() < 2) return text;
  for (size_t i = 0; i < std::min(violations.size(), kMaxViolations); ++i) {
    text += "\n  " + (violations[i].field.empty() ? "" : violations[i].field + ": ") +
            violations[i].description;
  }
  if (violations.size() > kMaxViolations) {
    text += fmt::format("\n  and {} more", violations.size() - kMaxViolations);
  }
  return text;
}

}  // namespace

void PrintText(const std::string& text) {
  static const bool is_terminal = ::isatty(STDOUT_FILENO) == 1;
  std::cout << (is_terminal ? EscapeControls(text, Lines::kMany) : text) << std::flush;
}

void PrintJson(const nlohmann::ordered_json& value) {
  // Names that are not UTF-8 must not stop the output. ASCII on a terminal, so that no control
  // character remains.
  const bool is_terminal = ::isatty(STDOUT_FILENO) == 1;
  std::cout << value.dump(2, ' ', is_terminal, nlohmann::json::error_handler_t::replace)
            << std::endl;
}

nlohmann::ordered_json ToJson(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) {
    throw Error(ErrorCode::kInternal,
                "cannot write {} as JSON: {}",
                message.GetTypeName(),
                status.ToString());
  }
  return nlohmann::ordered_json::parse(text);
}

void PrintJson(const google::protobuf::Message& message) { PrintJson(ToJson(message)); }

ExitCode PrintAnswer(const Context& context,
                     const google::protobuf::Message& answer,
                     const std::string& text) {
  if (context.json) {
    PrintJson(answer);
  } else {
    PrintText(text);
  }
  return ExitCode::kOk;
}

void PrintNote(const Context& context, const std::string& text) {
  if (!context.json) std::cerr << "color3d: note: " << EscapeControls(text) << std::endl;
}

ExitCode ReportException(const Context& context, const std::exception& exception) {
  if (const auto* failure = dynamic_cast<const CommandFailure*>(&exception)) {
    const char* name = failure->code() == ExitCode::kDetached ? "DETACHED" : "JOB_FAILED";
    PrintError(context, name, failure->what());
    return failure->code();
  }
  if (const auto* rpc = dynamic_cast<const RpcError*>(&exception)) {
    PrintError(context, ErrorCodeName(rpc->code()), WithViolations(*rpc));
    return ExitCodeOf(rpc->code());
  }
  if (const auto* error = dynamic_cast<const Error*>(&exception)) {
    const bool interrupted =
        error->code() == ErrorCode::kCancelled && context.interrupt->IsCancelled();
    PrintError(context,
               ErrorCodeName(error->code()),
               interrupted ? "interrupted before a job was submitted; run the same command again "
                             "(uploaded files are kept)"
                           : error->what());
    return ExitCodeOf(error->code());
  }
  PrintError(context, "INTERNAL", std::string("unexpected: ") + exception.what());
  return ExitCode::kJobFailed;
}

}  // namespace color3d::client
