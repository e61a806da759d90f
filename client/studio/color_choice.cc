#include "client/studio/color_choice.h"

#include "client/options/key_color_flags.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

KeyColorFlags FlagsOf(const ColorChoice& color, const std::filesystem::path& strokes) {
  KeyColorFlags flags;
  flags.hints = strokes;
  switch (color.from) {
    case ColorChoice::From::kNothing:
      break;
    case ColorChoice::From::kAutomatic:
      flags.automatic = true;
      break;
    case ColorChoice::From::kPicture:
      flags.image = color.picture;
      break;
    case ColorChoice::From::kReference:
      flags.references = {color.picture};
      break;
    case ColorChoice::From::kWords:
      flags.prompt = color.words;
      break;
  }
  return flags;
}

// Weights that understand words, by their name on the server.
std::string ModelOfWords(Connection& connection) {
  const v1::ServerInfo info = GetServerInfo(connection);
  for (const v1::ModelInfo& model : info.models()) {
    if (model.kind() == "clip") return model.name();
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "this service has no model that understands words; start it with --model NAME=FILE, "
              "the weights of CLIP, or choose another source of colours");
}

}  // namespace

v1::KeyColorSource UploadColors(Connection& connection,
                                const ColorChoice& color,
                                const std::filesystem::path& strokes) {
  KeyColorFlags flags = FlagsOf(color, strokes);
  if (color.from == ColorChoice::From::kWords) flags.model = ModelOfWords(connection);
  flags.Check();
  return UploadKeyColor(connection, flags);
}

}  // namespace color3d::client
