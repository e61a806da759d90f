// Live answers to strokes and automatic colours. Pictures stay prepared at the size of the answer,
// so that the next stroke on a photo waits only for its colours. Not thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "color3d/internal/v1/inference.pb.h"
#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/keycolor/hints/hints.h"
#include "server/worker/live/byte_bound_cache.h"

namespace color3d {

class StrokePreview {
 public:
  using Request = internal::v1::ColorizeImageRequest;
  using ReadBlob = std::function<std::string(const std::string& sha256)>;

  StrokePreview(int threads, int64_t cache_bytes) : pool_(threads), cache_(cache_bytes) {}

  // Whether the request has strokes or asks for automatic colours.
  static bool Takes(const Request& request) {
    return !request.points().empty() || request.automatic();
  }

  // Returns the coloured picture as a PNG: at the picture's own size as colorize_key_view makes it,
  // at a smaller one with strokes that are reduced like the picture, and with colours near those.
  // Throws Error{kInvalidArgument} for malformed strokes and pictures of other shapes.
  std::string Colorize(const Request& request, const ReadBlob& read_blob);

 private:
  struct Prepared {
    Image planes = {};  // L; or a, b; or none
    int own_width = 0;
    int own_height = 0;
    std::shared_ptr<QuickGrid> grid = {};  // of the strokes alone, or above other colours
    int64_t bytes = 0;
  };
  using Shared = std::shared_ptr<const Prepared>;

  Shared Luminance(const Request& request, const ReadBlob& read_blob, std::string* key);
  Shared Automatic(const Prepared& luminance, const std::string& key);
  Shared Below(const Request& request, const Prepared& luminance, const ReadBlob& read_blob);
  // Without `is_preview` nothing is approximated.
  Image Spread(const Prepared& luminance,
               const std::vector<ColorHint>& hints,
               bool is_preview,
               const std::string& key);
  Image LayAboveColors(const Prepared& luminance,
                       const Prepared& below,
                       const std::vector<ColorHint>& hints,
                       bool is_preview,
                       const std::string& key);
  std::string PngOf(const Image& luminance, const Image& ab, bool is_preview);
  // What `prepare` makes of a photo for quick solutions, or what is kept of it.
  Shared Grid(const std::string& key, const std::function<std::shared_ptr<QuickGrid>()>& prepare);
  // Of solutions that nobody watches or ends.
  RunControl Control() { return {pool_, checkpoints_, progress_, never_}; }

  NoCheckpoints checkpoints_;
  NullObserver progress_;
  const CancellationToken never_;
  ThreadPool pool_;
  ByteBoundCache<Prepared> cache_;
};

}  // namespace color3d
