// What a server answered when it did not answer OK, as an Error that keeps gRPC's details.
// Immutable values; thread-safe.
#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/catalogue/error_reasons.h"
#include "google/rpc/status.pb.h"

namespace color3d::client {

struct FieldViolation {
  std::string field;
  std::string description;
};

class RpcError : public Error {
 public:
  // `status` is not OK. Details are read from grpc-status-details-bin (google.rpc.Status).
  explicit RpcError(const grpc::Status& status);

  grpc::StatusCode grpc_code() const { return grpc_code_; }
  // google.rpc.ErrorInfo.reason, e.g. "DRAINING"; empty when the error is the transport's.
  const std::string& reason() const { return reason_; }
  bool HasReason(ErrorReason reason) const { return reason_ == ErrorReasonName(reason); }
  // google.rpc.BadRequest or QuotaFailure, in the server's order.
  const std::vector<FieldViolation>& violations() const { return violations_; }
  // The same call may succeed later: the connection broke, the server is overloaded or has ended
  // the call with itself (CANCELLED; whoever cancels calls looks at that first).
  bool IsTransient() const;
  // Too much was asked for just now: the same call may succeed after RetryDelay().
  bool IsTurnedAway() const;
  // google.rpc.RetryInfo; 0: the server did not say.
  std::chrono::seconds RetryDelay() const { return retry_delay_; }
  // Nobody answered: there is no server, or the connection broke.
  bool IsUnreachable() const;

 private:
  grpc::StatusCode grpc_code_;
  std::string reason_;
  std::chrono::seconds retry_delay_{0};
  std::vector<FieldViolation> violations_;
};

// Throws RpcError when `status` is not OK.
void ThrowIfFailed(const grpc::Status& status);

// gRPC's codes that we have no name for become the nearest one (OUT_OF_RANGE: kInvalidArgument).
ErrorCode ErrorCodeOf(grpc::StatusCode code);

// A job's error with its code's name: "INVALID_ARGUMENT: photo x is grey".
std::string DescribeStatus(const google::rpc::Status& status);

}  // namespace color3d::client
