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

// In the order of the enum.
constexpr auto kRows = std::to_array<Row>({
    {ErrorReason::kBadOption, "BAD_OPTION", ErrorCode::kInvalidArgument},
    {ErrorReason::kBlobDamaged, "BLOB_DAMAGED", ErrorCode::kDataLoss},
    {ErrorReason::kBlobMended, "BLOB_MENDED", ErrorCode::kUnavailable},
    {ErrorReason::kBlobMissing, "BLOB_MISSING", ErrorCode::kNotFound},
    {ErrorReason::kBlobUnreadable, "BLOB_UNREADABLE", ErrorCode::kUnavailable},
    {ErrorReason::kCertificateUnknown, "CERTIFICATE_UNKNOWN", ErrorCode::kPermissionDenied},
    {ErrorReason::kColorizerNotFound, "COLORIZER_NOT_FOUND", ErrorCode::kNotFound},
    {ErrorReason::kDigestMismatch, "DIGEST_MISMATCH", ErrorCode::kInvalidArgument},
    {ErrorReason::kDraining, "DRAINING", ErrorCode::kUnavailable},
    {ErrorReason::kImageTooLarge, "IMAGE_TOO_LARGE", ErrorCode::kInvalidArgument},
    {ErrorReason::kInferenceLost, "INFERENCE_LOST", ErrorCode::kUnavailable},
    {ErrorReason::kInputDeleted, "INPUT_DELETED", ErrorCode::kFailedPrecondition},
    {ErrorReason::kInputMissing, "INPUT_MISSING", ErrorCode::kFailedPrecondition},
    {ErrorReason::kJobNotFound, "JOB_NOT_FOUND", ErrorCode::kNotFound},
    {ErrorReason::kLeaseLost, "LEASE_LOST", ErrorCode::kAborted},
    {ErrorReason::kModelChanged, "MODEL_CHANGED", ErrorCode::kAborted},
    {ErrorReason::kNoColor, "NO_COLOR", ErrorCode::kInvalidArgument},
    {ErrorReason::kNoInferenceWorker, "NO_INFERENCE_WORKER", ErrorCode::kFailedPrecondition},
    {ErrorReason::kNotBuilt, "NOT_BUILT", ErrorCode::kUnimplemented},
    {ErrorReason::kOffsetBeyondEnd, "OFFSET_BEYOND_END", ErrorCode::kOutOfRange},
    {ErrorReason::kOffsetMismatch, "OFFSET_MISMATCH", ErrorCode::kInvalidArgument},
    {ErrorReason::kOtherScene, "OTHER_SCENE", ErrorCode::kInvalidArgument},
    {ErrorReason::kOutOfMemory, "OUT_OF_MEMORY", ErrorCode::kResourceExhausted},
    {ErrorReason::kOverloaded, "OVERLOADED", ErrorCode::kUnavailable},
    {ErrorReason::kPictureKillsWorker, "PICTURE_KILLS_WORKER", ErrorCode::kFailedPrecondition},
    {ErrorReason::kQueueFull, "QUEUE_FULL", ErrorCode::kResourceExhausted},
    {ErrorReason::kQuotaExceeded, "QUOTA_EXCEEDED", ErrorCode::kResourceExhausted},
    {ErrorReason::kRequestIdReused, "REQUEST_ID_REUSED", ErrorCode::kInvalidArgument},
    {ErrorReason::kRevisionCompacted, "REVISION_COMPACTED", ErrorCode::kOutOfRange},
    {ErrorReason::kRoleTooLow, "ROLE_TOO_LOW", ErrorCode::kPermissionDenied},
    {ErrorReason::kSceneExists, "SCENE_EXISTS", ErrorCode::kAlreadyExists},
    {ErrorReason::kSceneInUse, "SCENE_IN_USE", ErrorCode::kFailedPrecondition},
    {ErrorReason::kSceneInvalid, "SCENE_INVALID", ErrorCode::kInvalidArgument},
    {ErrorReason::kSceneNotActive, "SCENE_NOT_ACTIVE", ErrorCode::kFailedPrecondition},
    {ErrorReason::kSceneNotFound, "SCENE_NOT_FOUND", ErrorCode::kNotFound},
    {ErrorReason::kSizeMismatch, "SIZE_MISMATCH", ErrorCode::kInvalidArgument},
    {ErrorReason::kStageStuck, "STAGE_STUCK", ErrorCode::kDeadlineExceeded},
    {ErrorReason::kStorageFull, "STORAGE_FULL", ErrorCode::kResourceExhausted},
    {ErrorReason::kStoreBusy, "STORE_BUSY", ErrorCode::kUnavailable},
    {ErrorReason::kStoreCorrupt, "STORE_CORRUPT", ErrorCode::kDataLoss},
    {ErrorReason::kStoreError, "STORE_ERROR", ErrorCode::kInternal},
    {ErrorReason::kStoreNotReady, "STORE_NOT_READY", ErrorCode::kFailedPrecondition},
    {ErrorReason::kStoreNotWritable, "STORE_NOT_WRITABLE", ErrorCode::kFailedPrecondition},
    {ErrorReason::kStoreVersion, "STORE_VERSION", ErrorCode::kFailedPrecondition},
    {ErrorReason::kStreamSilent, "STREAM_SILENT", ErrorCode::kUnavailable},
    {ErrorReason::kTokenMissing, "TOKEN_MISSING", ErrorCode::kUnauthenticated},
    {ErrorReason::kTokenUnknown, "TOKEN_UNKNOWN", ErrorCode::kUnauthenticated},
    {ErrorReason::kTooManyStreams, "TOO_MANY_STREAMS", ErrorCode::kResourceExhausted},
    {ErrorReason::kUnknownBackend, "UNKNOWN_BACKEND", ErrorCode::kInvalidArgument},
    {ErrorReason::kUnknownModel, "UNKNOWN_MODEL", ErrorCode::kInvalidArgument},
    {ErrorReason::kUnsafePath, "UNSAFE_PATH", ErrorCode::kInvalidArgument},
    {ErrorReason::kUploadSilent, "UPLOAD_SILENT", ErrorCode::kUnavailable},
    {ErrorReason::kUploadTakenOver, "UPLOAD_TAKEN_OVER", ErrorCode::kAborted},
    {ErrorReason::kWorkerLost, "WORKER_LOST", ErrorCode::kInternal},
    {ErrorReason::kWorkerVersion, "WORKER_VERSION", ErrorCode::kFailedPrecondition},
    {ErrorReason::kWrongState, "WRONG_STATE", ErrorCode::kFailedPrecondition},
});

constexpr bool RowsAreInOrder() {
  for (size_t i = 0; i < kRows.size(); ++i) {
    if (static_cast<size_t>(kRows[i].reason) != i) return false;
  }
  return true;
}
static_assert(RowsAreInOrder());
static_assert(kRows.back().reason == ErrorReason::kWrongState, "every reason has a row");

const Row& RowOf(ErrorReason reason) { return kRows.at(static_cast<size_t>(reason)); }

}  // namespace

const char* ErrorReasonName(ErrorReason reason) { return RowOf(reason).name; }

ErrorCode ErrorReasonCode(ErrorReason reason) { return RowOf(reason).code; }

}  // namespace color3d
