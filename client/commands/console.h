// Output: results on stdout, notes and errors on stderr.
#pragma once

#include <google/protobuf/message.h>

#include <exception>
#include <nlohmann/json.hpp>
#include <string>

#include "client/commands/command.h"

namespace color3d::client {

// Escapes control characters other than line ends and tabs on a terminal, because names and
// messages come from a server.
void PrintText(const std::string& text);
void PrintJson(const nlohmann::ordered_json& value);
// In Protobuf's JSON mapping, fields with default values included.
void PrintJson(const google::protobuf::Message& message);
nlohmann::ordered_json ToJson(const google::protobuf::Message& message);
// Prints the answer of a server as JSON with --json, else as `text`. Returns kOk.
ExitCode PrintAnswer(const Context& context,
                     const google::protobuf::Message& answer,
                     const std::string& text);

// Prints "color3d: note: ..." on stderr; nothing with --json.
void PrintNote(const Context& context, const std::string& text);

// Prints the error on stderr and, with --json, as {"error": ...} on stdout. Returns the exit code.
ExitCode ReportException(const Context& context, const std::exception& exception);

}  // namespace color3d::client
