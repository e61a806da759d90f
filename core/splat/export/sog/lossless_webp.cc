#include "core/splat/export/sog/lossless_webp.h"

#include <webp/encode.h>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kEffort = 4;  // 0..9; more hardly shrinks data close to noise

class Picture {
 public:
  Picture() {
    if (WebPPictureInit(&picture) == 0) throw Error(ErrorCode::kInternal, "libwebp does not fit");
    WebPMemoryWriterInit(&written);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &written;
  }
  ~Picture() {
    WebPPictureFree(&picture);
    WebPMemoryWriterClear(&written);
  }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  WebPPicture picture;
  WebPMemoryWriter written;
};

}  // namespace

std::string EncodeLosslessWebp(const RgbaTexture& texture) {
  if (texture.width > WEBP_MAX_DIMENSION || texture.height > WEBP_MAX_DIMENSION) {
    throw InvalidArgument("a texture of {} x {} is too large for WebP, which ends at {} a side",
                          texture.width,
                          texture.height,
                          WEBP_MAX_DIMENSION);
  }
  WebPConfig config;
  if (WebPConfigInit(&config) == 0 || WebPConfigLosslessPreset(&config, kEffort) == 0) {
    throw Error(ErrorCode::kInternal, "libwebp does not know its lossless presets");
  }
  config.exact = 1;
  Picture p;
  p.picture.use_argb = 1;
  p.picture.width = texture.width;
  p.picture.height = texture.height;
  if (WebPPictureImportRGBA(&p.picture, texture.rgba.data(), 4 * texture.width) == 0 ||
      WebPEncode(&config, &p.picture) == 0) {
    throw Error(ErrorCode::kResourceExhausted,
                "cannot encode a texture of {} x {} as WebP (code {}): too little memory?",
                texture.width,
                texture.height,
                static_cast<int>(p.picture.error_code));
  }
  return std::string(reinterpret_cast<const char*>(p.written.mem), p.written.size);
}

}  // namespace color3d
