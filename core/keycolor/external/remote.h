// The key view coloured by a model server of the user's: what it is asked, and how its answer is
// judged. Knows no transport; server/backends speaks the protocol.
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

// Names of what a remote colourizer may claim to take, as in color3d.backend.v1.Capability.
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
  std::string description;  // "name version (licence)", as it calls itself
  std::set<std::string> capabilities;
  int64_t max_pixels = 0;  // largest picture it takes; <= 0: it does not say
  bool deterministic = false;
};

struct RemotePoint {
  double x_px = 0.0;
  double y_px = 0.0;
  std::string color;  // "#rrggbb"
};

struct RemoteRequest {
  std::string idempotency_key;  // the same key may be answered from a cache
  std::string image_png;        // grey, 16 bits
  std::string prompt;
  std::string reference_image;  // PNG; empty: none
  std::vector<RemotePoint> points;
  std::string mask_png;  // grey, white where colour may change; empty: everywhere
  uint64_t seed = 0;     // 0: none
};

// Pictures of the same scene made from one coloured picture.
struct RemoteGenerateRequest {
  std::string idempotency_key;
  std::string image_png;  // RGB, 8 bits
  std::string kind;       // capability::kOutpaint, kAnimate or kNovelView
  int samples = 1;        // 1..64
  uint64_t seed = 0;      // 0: none
};

// One model server. Used by one thread at a time. All calls return or throw within their time
// limit, and soon after `cancel` is set (Error{kCancelled}); Error{kUnavailable} when the server
// cannot be reached or is not ready, kDeadlineExceeded, or kFailedPrecondition for what it refuses.
class RemoteColorizer {
 public:
  virtual ~RemoteColorizer() = default;
  // Waits until the server is ready.
  virtual RemoteInfo GetInfo(ProgressObserver& progress, const CancellationToken& cancel) = 0;
  // The bytes of its picture, unchecked but for their number.
  virtual std::string Colorize(const RemoteRequest& request,
                               ProgressObserver& progress,
                               const CancellationToken& cancel) = 0;
  // The bytes of 1..samples pictures, unchecked but for their number and size. Defined here, by
  // default as Error{kUnimplemented}, because those who implement this link no library of ours.
  virtual std::vector<std::string> Generate(const RemoteGenerateRequest& request,
                                            ProgressObserver&,
                                            const CancellationToken&) {
    throw Error(ErrorCode::kUnimplemented,
                "this backend generates no " + request.kind + " pictures");
  }
};
// By the name in the server's configuration. Throws Error{kFailedPrecondition} for an unknown one.
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
  int sent_width = 0;  // smaller than the photo when the backend takes no larger one
  int sent_height = 0;
  int answer_width = 0;
  int answer_height = 0;
  // Of the answer's luminance from ours, which replaces it.
  double mean_luminance_difference = 0.0;  // mean |dL|, 0..100
  double luminance_correlation = 0.0;
  std::vector<std::string> warnings;
};

// `luminance`: 1 channel, L 0..100. Throws what RemoteColorizer throws; Error{kInvalidArgument} for
// options that do not fit the photo; Error{kFailedPrecondition} when the backend does not claim
// what the options need (both are named), or when its answer is not a PNG of the right shape, shows
// something else or has no colour.
RemoteSolution KeyColorFromRemote(const Image& luminance,
                                  const RemoteOptions& options,
                                  RemoteColorizer& remote,
                                  ProgressObserver& progress,
                                  const CancellationToken& cancel);

}  // namespace color3d
