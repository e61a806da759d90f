#include "client/commands/scene_target.h"

#include <fmt/core.h>

#include <filesystem>

#include "client/commands/console.h"
#include "client/lib/scene_upload.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"

namespace color3d::client {
namespace fs = std::filesystem;

std::string UploadFolder(Connection& connection,
                         const Context& context,
                         const PhotoFolder& folder,
                         ProgressDisplay& display) {
  const auto entries = BuildManifest(folder, MaxFileBytes(connection), *context.interrupt);
  const v1::Scene scene =
      UploadScene(connection, entries, folder.Name(), [&](int64_t done, int64_t total) {
        display.OnTransfer("uploading", done, total);
      });
  display.PrintLine(folder.splat  ? fmt::format("{}: the splat {}", scene.name(), folder.Name())
                    : folder.film ? fmt::format("{}: the film {}", scene.name(), folder.Name())
                    : !folder.camera_films.empty()
                        ? fmt::format("{}: {} films of cameras{}",
                                      scene.name(),
                                      folder.camera_films.size(),
                                      folder.model_files.empty() ? "; their poses will be estimated"
                                                                 : " with poses")
                        : fmt::format("{}: {} photos", scene.name(), scene.photo_count()));
  return scene.name();
}

std::string ResolveScene(Connection& connection,
                         const Context& context,
                         const std::string& text,
                         bool film,
                         ProgressDisplay& display) {
  if (!IsFolder(text) && !IsFile(text)) {
    if (film && text.starts_with("scenes/")) {
      throw InvalidArgument(
          "--film is for a folder; whether {} is a film was decided at its upload", text);
    }
    if (text.starts_with("scenes/")) return text;
    throw Error(ErrorCode::kNotFound,
                "'{}' is neither a folder of photos, a splat or a film, nor a scene on the server "
                "(scenes/ID; see `color3d scene list`)",
                text);
  }
  PhotoFolder folder = CollectPhotos(text, film);
  if (film) UsePhotosAsFrames(&folder);
  for (const std::string& note : folder.notes) PrintNote(context, note);
  return UploadFolder(connection, context, folder, display);
}

}  // namespace color3d::client
