#include "client/options/credit_flags.h"

#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/image/codec.h"
#include "core/image/credit/caption.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr int kCaptionJpegQuality = 95;

bool IsJpegName(const std::string& name) {
  const std::string ending = fs::path(name).extension().string();
  return ending == ".jpg" || ending == ".jpeg" || ending == ".JPG" || ending == ".JPEG";
}

std::string Captioned(const std::string& picture,
                      const std::string& text,
                      const std::string& name) {
  const Image whole = WithCaption(DecodeImage(picture, name), text);
  return IsJpegName(name) ? EncodeJpeg(whole, kCaptionJpegQuality) : EncodePng8(whole);
}

}  // namespace

void DeclareCreditFlags(CLI::App& app, CreditFlags* flags, bool with_caption) {
  const char* group = "Credit in the data of pictures (PNG text, XMP, IPTC)";
  const auto text = [&](const char* name, std::string* value, const char* help) {
    app.add_option(name, *value, help)->group(group);
  };
  text("--colored-by", &flags->credit.colored_by, "Who made the colours");
  text("--key-view-by", &flags->credit.key_view_by, "Who coloured the key view");
  text("--source", &flags->credit.source, "The original, e.g. an archive and its number");
  text("--licence", &flags->credit.licence, "Licence of the coloured pictures, e.g. \"CC BY 4.0\"");
  if (!with_caption) return;
  app.add_flag("--caption", flags->caption, "Also write it in a strip below each picture")
      ->group(group);
}

bool IsColoredPicture(const std::string& artifact) {
  if (!artifact.ends_with(".png") && !IsJpegName(artifact)) return false;
  for (const char* folder :
       {artifact::kRenders, artifact::kColoredPhotos, artifact::kFilmFrames, artifact::kFrames}) {
    if (artifact.starts_with(folder)) return true;
  }
  return fs::path(artifact).filename() == artifact::kKeyViewColored;
}

std::string WithCredit(const std::string& picture,
                       const CreditFlags& flags,
                       const std::string& name) {
  const std::string shown =
      flags.caption ? Captioned(picture, CreditText(flags.credit), name) : picture;
  return AddCredit(shown, flags.credit, name);
}

void CreditPictures(const fs::path& folder,
                    const std::vector<std::string>& names,
                    const CreditFlags& flags) {
  if (!flags.IsGiven()) return;
  for (const std::string& name : names) {
    if (!IsColoredPicture(name)) continue;
    WriteFileAtomic(folder / name, WithCredit(ReadFile(folder / name), flags, name));
  }
}

}  // namespace color3d::client
