// Whether a call may be made: the token that it brings, and what that allows. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>

#include <atomic>
#include <cstdint>
#include <memory>

#include "server/access/tokens.h"

namespace color3d {

class Access {
 public:
  // `tokens` null: everybody may do everything.
  explicit Access(std::shared_ptr<TokenBook> tokens) : tokens_(std::move(tokens)) {}

  // The token stands in the call's metadata: "authorization: Bearer TOKEN". Throws ServiceError
  // TOKEN_MISSING or TOKEN_UNKNOWN (UNAUTHENTICATED), ROLE_TOO_LOW (PERMISSION_DENIED).
  void Require(Role role, const grpc::CallbackServerContext& context) const;

 private:
  void LogRefusal(const std::string& why, const grpc::CallbackServerContext& context) const;

  std::shared_ptr<TokenBook> tokens_;
  mutable std::atomic<int64_t> last_refusal_s_{0};
};

}  // namespace color3d
