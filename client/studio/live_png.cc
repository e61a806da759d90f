#include "client/studio/live_png.h"

#include "client/lib/blob_transfer.h"
#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {

std::string LivePng(Connection& connection,
                    const LiveSource& source,
                    const LivePicture& picture,
                    int max_side_px) {
  std::string png;
  ColorizeLive(
      connection,
      source,
      {picture},
      {.max_side_px = max_side_px},
      [&](size_t, const v1::ColorizeImagesResponse& answer) {
        if (answer.has_error()) {
          throw Error(ErrorCodeOf(static_cast<grpc::StatusCode>(answer.error().code())),
                      "{}",
                      answer.error().message());
        }
        if (!answer.has_image_digest()) {
          png = answer.image();
          return;
        }
        const ScratchFolder scratch;
        const auto file = scratch.path() / "picture.png";
        const v1::Digest& digest = answer.image_digest();
        DownloadBlob(connection, {digest.sha256(), digest.size_bytes()}, file, [](int64_t) {});
        png = ReadFile(file);
      });
  return png;
}

}  // namespace color3d::client
