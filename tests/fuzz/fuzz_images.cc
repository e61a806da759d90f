// Fuzz target: pictures. Their headers as read by the server, and their pixels as decoded by a
// worker.
#include <cmath>
#include <string_view>

#include "core/image/codec.h"
#include "core/image/probe/focal_length.h"
#include "core/image/probe/orientation.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/formats/picture_files.h"
#include "tests/support/scenes/test_exif.h"

// libx265, which encodes the HEIC seeds, leaks a block at exit.
extern "C" const char* __lsan_default_suppressions() { return "leak:libx265\n"; }

namespace color3d {
namespace {

constexpr int64_t kDecodedPixels = 4096;  // larger pictures are slow and test no more

// 4 x 2 grey pixels in one strip, little-endian.
std::string Tiff() {
  const std::vector<ExifTag> tags = {{256, 3, 4},
                                     {257, 3, 2},
                                     {258, 3, 8},
                                     {259, 3, 1},
                                     {262, 3, 1},
                                     {273, 4, 122},
                                     {277, 3, 1},
                                     {278, 3, 2},
                                     {279, 4, 8}};
  std::string file("II*\0", 4);
  Put(&file, 8, 4);
  Put(&file, static_cast<uint32_t>(tags.size()), 2);
  for (const ExifTag& tag : tags) {
    Put(&file, tag.number, 2), Put(&file, tag.type, 2), Put(&file, 1, 4), Put(&file, tag.value, 4);
  }
  Put(&file, 0, 4);
  return file + "abcdefgh";
}

// Has width 0 if the header exceeds our limits, which are tested elsewhere.
ImageInfo ProbeUnlessHuge(std::string_view bytes) {
  try {
    const ImageInfo info = ProbeImage(bytes, "picture");
    if (info.width < 1) std::abort();
    return info;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kResourceExhausted) throw;
    return {};
  }
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  Image grey(5, 3, 1), color(4, 6, 3), transparent(3, 3, 4);
  for (Image* image : {&grey, &color, &transparent}) {
    float value = 0.0f;
    for (float& sample : image->data) sample = (value += 0.01f);
  }
  return {
      EncodePng8(grey),
      EncodePng16(color),
      EncodePng8(transparent),
      WithExif(EncodeJpeg(color), {{37386, 5, 50, 1}, {41989, 3, 35}}),
      EncodeJpeg(grey, 30),
      Tiff(),
      TiffFile({{.image = grey, .subfile_type = 1}, {.image = color, .photometric = 2}}),
      TiffFile(
          {{.image = grey, .profile = GrayGammaProfile(1.8), .sub_directories = {{.image = grey}}}},
          /*big_endian=*/true),
      WebpFile(color),
      WebpFile(color, AdobeRgbProfile()),
      BmpFile(color),
      BmpFile(color, AdobeRgbProfile()),
      HeicFile(Image(16, 16, 3, 0.5f), DisplayP3Profile()),
      WithPngProfile(EncodePng8(color), ProPhotoProfile()),
      WithPngProfile(EncodePng16(grey), DotGainProfile(20.0)),
      WithPngChunk(EncodePng8(grey), "gAMA", std::string("\0\1\x86\xA0", 4)),
      WithJpegProfile(EncodeJpeg(color), AdobeRgbProfile(), 200)};
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  return ReadOrRefuse([&] {
    const ImageInfo info = ProbeUnlessHuge(bytes);
    if (info.width == 0) return;
    if (info.height < 1 || info.channels < 1) std::abort();
    for (const std::string& note : PictureNotes(bytes)) {
      if (note.empty() || note.find('\n') != std::string::npos) std::abort();
    }
    if (int64_t{info.width} * info.height > kDecodedPixels) return;
    const Image image = DecodeImage(bytes, "picture", /*keep_alpha=*/true);
    const PictureSize shown = OrientedSize(info, ReadOrientation(bytes));
    if (image.width != shown.width || image.height != shown.height) std::abort();
    const double focal_px = ReadFocalLengthPx(bytes, shown.width, shown.height);
    if (!std::isfinite(focal_px) || focal_px < 0.0) std::abort();
    for (const float sample : image.data) {
      if (!(sample >= 0.0f && sample <= 1.0f)) std::abort();
    }
  });
}
