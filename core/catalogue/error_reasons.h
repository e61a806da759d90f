// Reasons of errors in the API (google.rpc.ErrorInfo.reason) and of failed jobs. Their names are
// stable: clients compare them. Thread-safe: constants only.
#pragma once

#include <optional>
#include <string_view>

#include "core/base/error.h"

namespace color3d {

enum class ErrorReason {
  kBadOption,
  kBlobDamaged,
  kBlobMended,
  kBlobMissing,
  kBlobUnreadable,
  kCertificateUnknown,
  kColorizerNotFound,
  kDigestMismatch,
  kDraining,
  kImageTooLarge,
  kInferenceLost,
  kInputDeleted,
  kInputMissing,
  kJobNotFound,
  kLeaseLost,
  kModelChanged,
  kNoColor,
  kNoInferenceWorker,
  kOffsetBeyondEnd,
  kOffsetMismatch,
  kOtherScene,
  kOutOfMemory,
  kOverloaded,
  kPictureKillsWorker,
  kQueueFull,
  kQuotaExceeded,
  kRequestIdReused,
  kRevisionCompacted,
  kRoleTooLow,
  kSceneExists,
  kSceneInUse,
  kSceneInvalid,
  kSceneNotActive,
  kSceneNotFound,
  kSizeMismatch,
  kStageStuck,
  kStorageFull,
  kStoreBusy,
  kStoreCorrupt,
  kStoreError,
  kStoreNotReady,
  kStoreNotWritable,
  kStoreVersion,
  kStreamSilent,
  kTokenMissing,
  kTokenUnknown,
  kTooManyStreams,
  kUnknownBackend,
  kUnknownModel,
  kUnsafePath,
  kUploadSilent,
  kUploadTakenOver,
  kWorkerLost,
  kWorkerVersion,
  kWrongState,
};

// Name on the wire, e.g. "BLOB_MISSING".
const char* ErrorReasonName(ErrorReason reason);
// Returns nothing for a name that this version does not know.
std::optional<ErrorReason> ErrorReasonFromName(std::string_view name);
// Code of errors with this reason, unless the place that throws names another one.
ErrorCode ErrorReasonCode(ErrorReason reason);

}  // namespace color3d
