// Colours pictures interactively with ColorizeImages. Not thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "color3d/v1/colorizer.pb.h"

namespace color3d::client {

// Source of the colours. Requires: exactly one is set, not empty; or points besides an example of
// the same picture or besides the automatic colorizer, whose colours lie below.
struct LiveSource {
  std::string colorizer;              // "colorizers/...", kAutomaticColorizer
  std::string scene;                  // "scenes/...", by its newest colorizer
  std::optional<v1::Digest> example;  // a blob: a coloured picture of the same things
  std::string points = {};            // JSON: strokes, px of the picture
};

// The colorizer of automatic colours.
inline constexpr char kAutomaticColorizer[] = "colorizers/automatic";

struct LivePicture {
  std::string label;                 // for messages and file names
  std::filesystem::path file;        // empty: `stored` is set
  std::optional<v1::Digest> stored;  // a blob that the server has
};

struct LiveOptions {
  int max_side_px = 0;  // longer side of the answers; 0: that of the pictures
  // Maximum number of pictures that are sent and not yet answered; 0: the limit of the server.
  int in_flight = 0;
};

// Opens and closes a stream, so that the server starts its inference worker.
void WarmUpInference(Connection& connection);

// Sends the pictures (files of more than 3 MiB as blobs) and passes each answer to the callback as
// it arrives, with the index of its picture. Answers may carry an `error`. Pictures with transient
// failures (UNAVAILABLE, a broken stream) are sent again until 30 s pass without an answer. Throws
// RpcError if the stream as a whole is refused, Error{kUnavailable} if patience is exhausted, and
// Error{kCancelled}.
void ColorizeLive(Connection& connection,
                  const LiveSource& source,
                  const std::vector<LivePicture>& pictures,
                  const LiveOptions& options,
                  const std::function<void(size_t, const v1::ColorizeImagesResponse&)>& on_answer);

}  // namespace color3d::client
