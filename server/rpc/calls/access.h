// Whether a call may be made: the token that it brings, or the certificate of its connection, and
// what that allows. Thread-safe.
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

// Who calls, and for which project.
struct Caller {
  std::string name;  // empty: the server asks nobody who he is
  Role role = Role::kAdmin;
  std::string project;
};

// For logs.
inline const char* NameOf(const Caller& caller) {
  return caller.name.empty() ? "somebody" : caller.name.c_str();
}

// What follows "Bearer " in the metadata "authorization"; empty for anything else.
std::string_view TokenOf(std::string_view authorization);

class Access {
 public:
  // Both null: everybody may do everything. With both a call's token decides, and without one the
  // certificate of its connection.
  explicit Access(std::shared_ptr<TokenBook> tokens,
                  std::shared_ptr<CertificateRoles> certificates = nullptr)
      : tokens_(std::move(tokens)), certificates_(std::move(certificates)) {}

  // The token stands in the call's metadata: "authorization: Bearer TOKEN". Throws ServiceError
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
