// ColorizeImages streams: checks each picture, forwards it to the inference worker, and writes the
// answers as they come. A stream reads on only as its answers are taken, so a slow reader costs
// bounded memory.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <set>

#include "color3d/v1/colorizer.grpc.pb.h"
#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/live/inference_client.h"

namespace color3d {

class ColorizeStream;

struct ColorizeLimits {
  int window = 16;         // pictures of one stream that are read and not yet answered
  int max_streams = 64;    // further ones: RESOURCE_EXHAUSTED (TOO_MANY_STREAMS)
  int max_pictures = 128;  // of all streams; each may have one in any case
  // A stream without an unanswered picture, to which none came for so long, is ended.
  std::chrono::milliseconds silence{15 * 60'000};
};

class ColorizeHub {
 public:
  // Taken and not answered yet, of all streams.
  int pictures() const { return pictures_.load(); }
  ColorizeHub(const RpcParts& parts, InferenceLink link, ColorizeLimits limits = {});
  ColorizeHub(const ColorizeHub&) = delete;
  ColorizeHub& operator=(const ColorizeHub&) = delete;

  grpc::ServerBidiReactor<v1::ColorizeImagesRequest, v1::ColorizeImagesResponse>* Open(
      grpc::CallbackServerContext* context);
  // Streams take no more pictures, answer those that they have and end with UNAVAILABLE (DRAINING).
  void Drain();

 private:
  friend class ColorizeStream;
  void Unregister(ColorizeStream* stream);

  const RpcParts& parts_;
  InferenceClient client_;
  const ColorizeLimits limits_;
  std::atomic<int> pictures_{0};
  std::mutex mutex_;
  bool draining_ = false;
  std::set<std::shared_ptr<ColorizeStream>> streams_;
};

}  // namespace color3d
