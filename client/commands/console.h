// What goes to stdout (results) and to stderr (notes, errors).
#pragma once

#include <google/protobuf/message.h>

#include <exception>
#include <nlohmann/json.hpp>
#include <string>

#include "client/commands/command.h"

namespace color3d::client {

// On a terminal nothing but line ends and tabs controls it: names and messages are a server's.
void PrintText(const std::string& text);
void PrintJson(const nlohmann::ordered_json& value);
// Protobuf's JSON mapping, with fields that have their default value.
void PrintJson(const google::protobuf::Message& message);
nlohmann::ordered_json ToJson(const google::protobuf::Message& message);

// "color3d: note: ..." on stderr; nothing with --json.
void PrintNote(const Context& context, const std::string& text);

// Says on stderr what went wrong (with --json also as {"error": ...} on stdout); returns the exit
// code that fits.
ExitCode ReportException(const Context& context, const std::exception& exception);

}  // namespace color3d::client
