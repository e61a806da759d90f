#include "core/catalogue/error_reasons.h"

#include <array>
#include <cstddef>

namespace color3d {
namespace {

struct Row {
  ErrorReason reason;
  const char* name;
  ErrorCode code;
};

using enum ErrorReason;
using enum ErrorCode;

// In the order of the enum.
constexpr auto kRows = std::to_array<Row>({
    {kBadOption, "BAD_OPTION", kInvalidArgument},
    {kBlobDamaged, "BLOB_DAMAGED", kDataLoss},
    {kBlobMended, "BLOB_MENDED", kUnavailable},
    {kBlobMissing, "BLOB_MISSING", kNotFound},
    {kBlobUnreadable, "BLOB_UNREADABLE", kUnavailable},
    {kCertificateUnknown, "CERTIFICATE_UNKNOWN", kPermissionDenied},
    {kColorizerNotFound, "COLORIZER_NOT_FOUND", kNotFound},
    {kDigestMismatch, "DIGEST_MISMATCH", kInvalidArgument},
    {kDraining, "DRAINING", kUnavailable},
    {kImageTooLarge, "IMAGE_TOO_LARGE", kInvalidArgument},
    {kInferenceLost, "INFERENCE_LOST", kUnavailable},
    {kInputDeleted, "INPUT_DELETED", kFailedPrecondition},
    {kInputMissing, "INPUT_MISSING", kFailedPrecondition},
    {kJobNotFound, "JOB_NOT_FOUND", kNotFound},
    {kLeaseLost, "LEASE_LOST", kAborted},
    {kModelChanged, "MODEL_CHANGED", kAborted},
    {kNoColor, "NO_COLOR", kInvalidArgument},
    {kNoInferenceWorker, "NO_INFERENCE_WORKER", kFailedPrecondition},
    {kOffsetBeyondEnd, "OFFSET_BEYOND_END", kOutOfRange},
    {kOffsetMismatch, "OFFSET_MISMATCH", kInvalidArgument},
    {kOtherScene, "OTHER_SCENE", kInvalidArgument},
    {kOutOfMemory, "OUT_OF_MEMORY", kResourceExhausted},
    {kOverloaded, "OVERLOADED", kUnavailable},
    {kPictureKillsWorker, "PICTURE_KILLS_WORKER", kFailedPrecondition},
    {kQueueFull, "QUEUE_FULL", kResourceExhausted},
    {kQuotaExceeded, "QUOTA_EXCEEDED", kResourceExhausted},
    {kRequestIdReused, "REQUEST_ID_REUSED", kInvalidArgument},
    {kRevisionCompacted, "REVISION_COMPACTED", kOutOfRange},
    {kRoleTooLow, "ROLE_TOO_LOW", kPermissionDenied},
    {kSceneExists, "SCENE_EXISTS", kAlreadyExists},
    {kSceneInUse, "SCENE_IN_USE", kFailedPrecondition},
    {kSceneInvalid, "SCENE_INVALID", kInvalidArgument},
    {kSceneNotActive, "SCENE_NOT_ACTIVE", kFailedPrecondition},
    {kSceneNotFound, "SCENE_NOT_FOUND", kNotFound},
    {kSizeMismatch, "SIZE_MISMATCH", kInvalidArgument},
    {kStageStuck, "STAGE_STUCK", kDeadlineExceeded},
    {kStorageFull, "STORAGE_FULL", kResourceExhausted},
    {kStoreBusy, "STORE_BUSY", kUnavailable},
    {kStoreCorrupt, "STORE_CORRUPT", kDataLoss},
    {kStoreError, "STORE_ERROR", kInternal},
    {kStoreNotReady, "STORE_NOT_READY", kFailedPrecondition},
    {kStoreNotWritable, "STORE_NOT_WRITABLE", kFailedPrecondition},
    {kStoreVersion, "STORE_VERSION", kFailedPrecondition},
    {kStreamSilent, "STREAM_SILENT", kUnavailable},
    {kTokenMissing, "TOKEN_MISSING", kUnauthenticated},
    {kTokenUnknown, "TOKEN_UNKNOWN", kUnauthenticated},
    {kTooManyStreams, "TOO_MANY_STREAMS", kResourceExhausted},
    {kUnknownBackend, "UNKNOWN_BACKEND", kInvalidArgument},
    {kUnknownModel, "UNKNOWN_MODEL", kInvalidArgument},
    {kUnsafePath, "UNSAFE_PATH", kInvalidArgument},
    {kUploadSilent, "UPLOAD_SILENT", kUnavailable},
    {kUploadTakenOver, "UPLOAD_TAKEN_OVER", kAborted},
    {kWorkerLost, "WORKER_LOST", kInternal},
    {kWorkerVersion, "WORKER_VERSION", kFailedPrecondition},
    {kWrongState, "WRONG_STATE", kFailedPrecondition},
});

constexpr bool RowsAreInOrder() {
  for (size_t i = 0; i < kRows.size(); ++i) {
    if (static_cast<size_t>(kRows[i].reason) != i) return false;
  }
  return true;
}
static_assert(RowsAreInOrder());
static_assert(kRows.back().reason == kWrongState, "every reason has a row");

const Row& RowOf(ErrorReason reason) { return kRows.at(static_cast<size_t>(reason)); }

}  // namespace

const char* ErrorReasonName(ErrorReason reason) { return RowOf(reason).name; }

std::optional<ErrorReason> ErrorReasonFromName(std::string_view name) {
  for (const Row& row : kRows) {
    if (name == row.name) return row.reason;
  }
  return std::nullopt;
}

ErrorCode ErrorReasonCode(ErrorReason reason) { return RowOf(reason).code; }

}  // namespace color3d
