// Colours the key view by a model server of the user: requests and validation of answers.
// Independent of the transport, which is in server/backends.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/progress.h"
#include "core/keycolor/hints/hints.h"

namespace color3d {

// Names of the capabilities of remote colourizers, as in color3d.backend.v1.Capability.
namespace capability {
inline constexpr char kAutomatic[] = "automatic";
inline constexpr char kTextPrompt[] = "text_prompt";
inline constexpr char kReferenceImage[] = "reference_image";
inline constexpr char kColorPoints[] = "color_points";
inline constexpr char kMask[] = "mask";
inline constexpr char kSeed[] = "seed";
inline constexpr char kOutpaint[] = "outpaint";
inline constexpr char kAnimate[] = "animate";
inline constexpr char kNovelView[] = "novel_view";
}  // namespace capability

struct RemoteInfo {
  std::string description;  // "name version (licence)", as given by the server
  std::set<std::string> capabilities;
  int64_t max_pixels = 0;  // maximum size of a picture; <= 0: unknown
  bool deterministic = false;
};

struct RemotePoint {
  double x_px = 0.0;
  double y_px = 0.0;
  std::string color;  // "#rrggbb"
};

struct RemoteRequest {
  std::string idempotency_key;  // the server may cache answers by this key
  std::string image_png;        // grey, 16 bits
  std::string prompt;
  std::string reference_image;  // PNG; empty: none
  std::vector<RemotePoint> points;
  std::string mask_png;  // grey, white where colour may change; empty: everywhere
  uint64_t seed = 0;     // 0: none
};

// Request of pictures of the same scene, made from one coloured picture.
struct RemoteGenerateRequest {
  std::string idempotency_key;
  std::string image_png;  // RGB, 8 bits
  std::string kind;       // capability::kOutpaint, kAnimate or kNovelView
  int samples = 1;        // 1..64
  uint64_t seed = 0;      // 0: none
};

// A model server. Not thread-safe. All calls end within their time limit, and soon after `cancel`
// is set (Error{kCancelled}). They throw Error{kUnavailable} if the server cannot be reached or is
// not ready, kDeadlineExceeded, and kFailedPrecondition if it refuses.
class RemoteColorizer {
 public:
  virtual ~RemoteColorizer() = default;
  // Waits until the server is ready.
  virtual RemoteInfo GetInfo(ProgressObserver& progress, const CancellationToken& cancel) = 0;
  // Returns the bytes of the picture. Only their number has been checked.
  virtual std::string Colorize(const RemoteRequest& request,
                               ProgressObserver& progress,
                               const CancellationToken& cancel) = 0;
  // Returns the bytes of 1..samples pictures. Only number and sizes have been checked. Throws
  // Error{kUnimplemented} by default. Inline, because implementations do not link this library.
  virtual std::vector<std::string> Generate(const RemoteGenerateRequest& request,
                                            ProgressObserver&,
                                            const CancellationToken&) {
    throw Error(ErrorCode::kUnimplemented,
                "this backend generates no " + request.kind + " pictures");
  }
};
// Returns a backend by its name in the server's configuration. Throws Error{kFailedPrecondition} if
// it is unknown.
using RemoteColorizerFactory =
    std::function<std::unique_ptr<RemoteColorizer>(const std::string& name)>;

struct RemoteOptions {
  std::string name;  // of the backend, for messages
  std::string idempotency_key;
  std::string prompt;
  std::vector<ColorHint> points;
  Image reference;  // sRGB; empty: none
  Image mask;       // 1 channel 0..1 of the photo's size; empty: everywhere
  uint64_t seed = 1;
};

struct RemoteSolution {
  Image ab;  // 2 channels, Lab units, the photo's size; 0 outside the mask
  RemoteInfo info;
  int sent_width = 0;  // smaller than the photo if the backend limits the size
  int sent_height = 0;
  int answer_width = 0;
  int answer_height = 0;
  // Difference of the answer's luminance from the photo's, which replaces it.
  double mean_luminance_difference = 0.0;  // mean |dL|, 0..100
  double luminance_correlation = 0.0;
  std::vector<std::string> warnings;
};

// `luminance`: 1 channel, L 0..100. Throws the errors of RemoteColorizer, Error{kInvalidArgument}
// for options that do not fit the photo, and Error{kFailedPrecondition} if the backend lacks a
// capability that the options need (it is named), or if its answer is no PNG of the right shape,
// shows something else or has no colour.
RemoteSolution KeyColorFromRemote(const Image& luminance,
                                  const RemoteOptions& options,
                                  RemoteColorizer& remote,
                                  ProgressObserver& progress,
                                  const CancellationToken& cancel);

}  // namespace color3d
