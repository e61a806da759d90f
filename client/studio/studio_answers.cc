#include "client/studio/studio_answers.h"

#include <cstdlib>

#include "client/lib/text.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

using Json = nlohmann::ordered_json;
constexpr int64_t kMaxJsonBytes = 2 << 20;
constexpr char kCsp[] = "Content-Security-Policy";

int StatusOf(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kOutOfRange:
      return 400;
    case ErrorCode::kUnauthenticated:
    case ErrorCode::kPermissionDenied:
      return 403;
    case ErrorCode::kNotFound:
      return 404;
    case ErrorCode::kAlreadyExists:
    case ErrorCode::kFailedPrecondition:
    case ErrorCode::kAborted:
      return 409;
    case ErrorCode::kResourceExhausted:
      return 507;
    case ErrorCode::kCancelled:
    case ErrorCode::kUnavailable:
    case ErrorCode::kDeadlineExceeded:
      return 503;
    default:
      return 500;
  }
}

Error TooLarge(int64_t max_bytes) {
  return Error(
      ErrorCode::kResourceExhausted, "at most {} are taken at a time", HumanBytes(max_bytes));
}

void SetOnce(const char* name, const char* value, httplib::Response& response) {
  if (!response.has_header(name)) response.set_header(name, value);
}

}  // namespace

void AnswerJson(const Json& json, httplib::Response& response) {
  response.set_content(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                       "application/json");
}

void AnswerError(int status,
                 const std::string& code,
                 const std::string& message,
                 httplib::Response& response) {
  response.status = status;
  AnswerJson({{"error", {{"code", code}, {"message", message}}}}, response);
}

void AnswerException(const std::exception& exception, httplib::Response& response) {
  if (const auto* error = dynamic_cast<const Error*>(&exception)) {
    AnswerError(StatusOf(error->code()), ErrorCodeName(error->code()), error->what(), response);
  } else {
    AnswerError(500, "INTERNAL", std::string("unexpected: ") + exception.what(), response);
  }
}

void AddSafetyHeaders(httplib::Response& response) {
  SetOnce(kCsp,
          "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
          "media-src 'self' blob:; connect-src 'self'; frame-src 'self'; base-uri 'none'; "
          "form-action 'none'; "
          "frame-ancestors 'none'",
          response);
  SetOnce("Cache-Control", "no-store", response);
  SetOnce("X-Content-Type-Options", "nosniff", response);
  SetOnce("Referrer-Policy", "no-referrer", response);
  SetOnce("Cross-Origin-Resource-Policy", "same-origin", response);
  SetOnce("Cross-Origin-Opener-Policy", "same-origin", response);
}

void AnswerSandboxed(const std::string& html, httplib::Response& response) {
  response.set_header(
      kCsp,
      "sandbox allow-scripts allow-pointer-lock; default-src 'none'; script-src 'unsafe-inline' "
      "'unsafe-eval' blob: data:; style-src 'unsafe-inline'; img-src blob: data:; font-src data:; "
      "media-src blob: data:; connect-src blob: data:; worker-src blob: data:; base-uri 'none'; "
      "form-action 'none'; frame-ancestors 'self'");
  response.set_content(html, "text/html; charset=utf-8");
}

void SetDownloadName(const std::string& name, httplib::Response& response) {
  std::string plain = name;
  std::erase_if(plain, [](char c) { return c == '"' || c == '\\' || c < ' ' || c > '~'; });
  response.set_header("Content-Disposition", "attachment; filename=\"" + plain + "\"");
}

void RequireLength(const httplib::Request& request, int64_t max_bytes) {
  if (!request.has_header("Content-Length")) return;  // counted as it arrives
  const std::string text = request.get_header_value("Content-Length");
  if (text.size() > 18 || std::atoll(text.c_str()) > max_bytes) throw TooLarge(max_bytes);
}

std::string ReadBody(const httplib::Request& request,
                     const httplib::ContentReader& reader,
                     int64_t max_bytes) {
  RequireLength(request, max_bytes);
  std::string body;
  bool is_too_large = false;
  const bool is_whole = reader([&](const char* bytes, size_t count) {
    is_too_large = static_cast<int64_t>(body.size() + count) > max_bytes;
    if (!is_too_large) body.append(bytes, count);
    return !is_too_large;
  });
  if (is_too_large) throw TooLarge(max_bytes);
  if (!is_whole) throw Error(ErrorCode::kAborted, "the request did not arrive whole");
  return body;
}

nlohmann::json ReadJsonBody(const httplib::Request& request, const httplib::ContentReader& reader) {
  const std::string body = ReadBody(request, reader, kMaxJsonBytes);
  if (body.empty()) return nlohmann::json::object();
  nlohmann::json json = nlohmann::json::parse(body, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) throw InvalidArgument("the body is not a JSON object");
  return json;
}

}  // namespace color3d::client
