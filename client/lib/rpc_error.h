// Errors of RPCs, with gRPC's details. Immutable values; thread-safe.
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
  // Requires: `status` is not OK. Details are read from grpc-status-details-bin
  // (google.rpc.Status).
  explicit RpcError(const grpc::Status& status);

  grpc::StatusCode grpc_code() const { return grpc_code_; }
  // google.rpc.ErrorInfo.reason, e.g. "DRAINING"; empty for errors of the transport.
  const std::string& reason() const { return reason_; }
  bool HasReason(ErrorReason reason) const { return reason_ == ErrorReasonName(reason); }
  // google.rpc.BadRequest or QuotaFailure, in the server's order.
  const std::vector<FieldViolation>& violations() const { return violations_; }
  // Returns true if the same call may succeed later: the connection broke, the server is
  // overloaded, or it ended the call itself (CANCELLED; callers that cancel calls check that
  // first).
  bool IsTransient() const;
  // Returns true for a busy server: the same call may succeed after RetryDelay().
  bool IsTurnedAway() const;
  // google.rpc.RetryInfo; 0: not set by the server.
  std::chrono::seconds RetryDelay() const { return retry_delay_; }
  // Returns true if there was no answer: there is no server, or the connection broke.
  bool IsUnreachable() const;

 private:
  grpc::StatusCode grpc_code_;
  std::string reason_;
  std::chrono::seconds retry_delay_{0};
  std::vector<FieldViolation> violations_;
};

// Throws RpcError if `status` is not OK.
void ThrowIfFailed(const grpc::Status& status);

// Maps gRPC codes without an ErrorCode to the nearest one (OUT_OF_RANGE: kInvalidArgument).
ErrorCode ErrorCodeOf(grpc::StatusCode code);

// Returns a job's error with the name of its code: "INVALID_ARGUMENT: photo x is grey".
std::string DescribeStatus(const google::rpc::Status& status);

}  // namespace color3d::client
