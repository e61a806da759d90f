#include "server/rpc/calls/access.h"

#include <grpc/grpc_security_constants.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>
#include <vector>

#include "server/base/service_error.h"

namespace color3d {
namespace {

constexpr std::string_view kScheme = "Bearer ";

std::string_view AuthorizationHeader(const grpc::CallbackServerContext& context) {
  const auto entry = context.client_metadata().find("authorization");
  if (entry == context.client_metadata().end()) return {};
  return {entry->second.data(), entry->second.size()};
}

// Names of the client's certificate: common name, then alternative names.
std::vector<std::string> CertificateNames(const grpc::CallbackServerContext& context) {
  const auto identity = context.auth_context();
  std::vector<std::string> names;
  for (const char* property : {GRPC_X509_CN_PROPERTY_NAME, GRPC_X509_SAN_PROPERTY_NAME}) {
    for (const grpc::string_ref& name : identity->FindPropertyValues(property)) {
      names.emplace_back(name.data(), name.size());
    }
  }
  return names;
}

}  // namespace

std::string_view ParseBearerToken(std::string_view authorization) {
  return authorization.starts_with(kScheme) ? authorization.substr(kScheme.size())
                                            : std::string_view();
}

// At most once a second, so that refusals do not fill the disk.
void Access::LogRefusal(const std::string& why, const grpc::CallbackServerContext& context) const {
  const int64_t now = std::chrono::duration_cast<std::chrono::seconds>(
                          std::chrono::steady_clock::now().time_since_epoch())
                          .count();
  if (last_refusal_s_.exchange(now) != now) {
    spdlog::warn("a call from {} was refused: {}", context.peer(), why);
  }
}

Caller Access::Require(Role role, const grpc::CallbackServerContext& context) const {
  if (!tokens_ && !certificates_) return {};
  const std::string_view token = ParseBearerToken(AuthorizationHeader(context));
  const bool by_token = tokens_ && (!certificates_ || !token.empty());
  const Caller caller = by_token ? ByToken(token, context) : ByCertificate(context);
  if (!Includes(caller.role, role)) {
    LogRefusal(caller.name + " may only " + RoleName(caller.role), context);
    throw ServiceError(ErrorReason::kRoleTooLow,
                       "the {} of '{}' has the role {}; this call needs {}",
                       by_token ? "token" : "certificate",
                       caller.name,
                       RoleName(caller.role),
                       RoleName(role));
  }
  return caller;
}

Caller Access::ByToken(std::string_view token, const grpc::CallbackServerContext& context) const {
  if (token.empty()) {
    LogRefusal("no token", context);
    throw ServiceError(
        ErrorReason::kTokenMissing,
        "this server requires a token: use `color3d --token-file FILE` or COLOR3D_TOKEN");
  }
  const std::optional<TokenRecord> record = tokens_->Find(token);
  if (!record) {
    LogRefusal("unknown token", context);
    throw ServiceError(ErrorReason::kTokenUnknown,
                       "this server does not know the token; ask its operator for a new one");
  }
  return {record->name, record->role, record->project};
}

Caller Access::ByCertificate(const grpc::CallbackServerContext& context) const {
  const std::vector<std::string> names = CertificateNames(context);
  const std::optional<CertificateRecord> record = certificates_->Find(names);
  if (!record) {
    const std::string name = names.empty() ? "" : names.front();
    LogRefusal("the certificate of '" + name + "' has no role", context);
    throw ServiceError(
        ErrorReason::kCertificateUnknown,
        "the certificate of '{}' has no role on this server; ask its operator to add "
        "it to the file of --certificate-roles",
        name);
  }
  return {record->name, record->role, record->project};
}

}  // namespace color3d
