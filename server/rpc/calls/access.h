// Authentication and authorization of calls, by token or by the certificate of the connection.
// Thread-safe.
#pragma once

#include <grpcpp/server_context.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "server/access/certificate_roles.h"
#include "server/access/tokens.h"

namespace color3d {

// Authenticated caller and its project.
struct Caller {
  std::string name;  // empty: the server does not authenticate
  Role role = Role::kAdmin;
  std::string project;
};

// Name for logs.
inline const char* CallerName(const Caller& caller) {
  return caller.name.empty() ? "somebody" : caller.name.c_str();
}

// Returns the part after "Bearer " of the metadata "authorization"; empty for other schemes.
std::string_view ParseBearerToken(std::string_view authorization);

class Access {
 public:
  // Both null: every call is allowed. With both, the token of a call decides; a call without a
  // token is judged by the certificate of its connection.
  explicit Access(std::shared_ptr<TokenBook> tokens,
                  std::shared_ptr<CertificateRoles> certificates = nullptr)
      : tokens_(std::move(tokens)), certificates_(std::move(certificates)) {}

  // Reads the token from the metadata "authorization: Bearer TOKEN". Throws ServiceError
  // TOKEN_MISSING or TOKEN_UNKNOWN (UNAUTHENTICATED), CERTIFICATE_UNKNOWN or ROLE_TOO_LOW
  // (PERMISSION_DENIED).
  Caller Require(Role role, const grpc::CallbackServerContext& context) const;

 private:
  Caller ByToken(std::string_view token, const grpc::CallbackServerContext& context) const;
  Caller ByCertificate(const grpc::CallbackServerContext& context) const;
  void LogRefusal(const std::string& why, const grpc::CallbackServerContext& context) const;

  std::shared_ptr<TokenBook> tokens_;
  std::shared_ptr<CertificateRoles> certificates_;
  mutable std::atomic<int64_t> last_refusal_s_{0};
};

}  // namespace color3d
