#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/photos/gray_copies.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

constexpr int kMaxPhotos = 24;
constexpr char kUnsure[] =
    "; unsure: prints with stains or tints look the same as photos of mostly one hue";

ExitCode RunInspect(const Context& context, const std::string& photos) {
  const PhotoFolder folder = CollectPhotos(photos);
  if (folder.splat) {
    throw InvalidArgument("{} is a splat; inspect needs photos", folder.splat->file.string());
  }
  if (folder.film || !folder.camera_films.empty()) {
    const LocalFile& film = folder.film ? *folder.film : folder.camera_films.front();
    throw InvalidArgument(
        "{} is a film; inspect needs pictures: give some of its frames as pictures in a folder",
        film.file.string());
  }
  for (const std::string& note : folder.notes) PrintNote(context, note);
  const ColorCount count = CountColorPhotos(folder, kMaxPhotos, *context.interrupt);
  const std::string kind = count.MostlyColor() ? "colour" : "monochrome";
  if (context.json) {
    PrintJson({{"kind", kind},
               {"photos", count.photos},
               {"looked_at", count.looked_at},
               {"in_colour", count.in_color},
               {"monochrome", count.looked_at - count.in_color},
               {"unsure", count.unsure},
               {"sure", count.IsSure()}});
  } else {
    PrintText(fmt::format("{}: {} of {} inspected photos are in colour ({} photos){}\n",
                          kind,
                          count.in_color,
                          count.looked_at,
                          count.photos,
                          count.IsSure() ? "" : kUnsure));
  }
  return ExitCode::kOk;
}

}  // namespace

void AddInspectCommand(CLI::App& app, Context& context) {
  auto photos = std::make_shared<std::string>();
  AddCommand(app,
             context,
             "inspect",
             "Report whether photos are in colour or monochrome",
             [&context, photos] { return RunInspect(context, *photos); })
      ->add_option("PHOTOS", *photos, "Folder of photos")
      ->required();
}

}  // namespace color3d::client
