// Answers of the studio: JSON, files, errors and the headers that protect the page. Pure functions.
#pragma once

#include <exception>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "client/studio/http_library.h"

namespace color3d::client {

void AnswerJson(const nlohmann::ordered_json& json, httplib::Response& response);

// {"error": {"code": ..., "message": ...}} with the status of HTTP that is nearest to the error.
void AnswerError(int status,
                 const std::string& code,
                 const std::string& message,
                 httplib::Response& response);
void AnswerException(const std::exception& exception, httplib::Response& response);

// Headers of every answer: nothing is stored, framed by others or loaded from elsewhere.
void AddSafetyHeaders(httplib::Response& response);
// A page that the service made (view.html, report.html): shown in a frame, without access to the
// studio, this machine or the network.
void AnswerSandboxed(const std::string& html, httplib::Response& response);

// The browser keeps the answer as a file; characters that a header cannot hold are left out.
void SetDownloadName(const std::string& name, httplib::Response& response);

// The whole body. Throws Error{kResourceExhausted} above `max_bytes`, kAborted if it ends early.
std::string ReadBody(const httplib::Request& request,
                     const httplib::ContentReader& reader,
                     int64_t max_bytes);
// The same as a JSON object; {} for an empty body. Throws Error{kInvalidArgument}.
nlohmann::json ReadJsonBody(const httplib::Request& request, const httplib::ContentReader& reader);

// Throws Error{kResourceExhausted} if the body is announced to be larger than `max_bytes`.
void RequireLength(const httplib::Request& request, int64_t max_bytes);

}  // namespace color3d::client
