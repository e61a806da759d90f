#include "client/commands/live_files.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "client/commands/console.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/names.h"
#include "client/lib/out_folder.h"
#include "client/lib/photos/skipped_files.h"
#include "client/lib/text.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr size_t kShownErrors = 2;

void AddFolder(const Context& context, const fs::path& folder, std::vector<LivePicture>* pictures) {
  const bool nested = IsFolder(folder / "images");
  const fs::path root = nested ? folder / "images" : folder;
  SkippedFiles skipped;
  const std::vector<std::string> found = ListPictures(root, /*with_subfolders=*/false, &skipped);
  if (found.empty()) {
    throw InvalidArgument("there are no photos in {}{}", root.string(), skipped.Clause());
  }
  for (const std::string& note : skipped.Notes()) PrintNote(context, note);
  for (const std::string& file : found) pictures->push_back({file, root / file, std::nullopt});
}

// Distinct names for the coloured pictures.
std::vector<std::string> OutputNames(const std::vector<LivePicture>& pictures) {
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const LivePicture& picture : pictures) {
    const std::string stem = Stem(picture.label);
    std::string name = stem + ".png";
    for (int i = 2; !taken.insert(name).second; ++i) {
      name = fmt::format("{}_{}.png", stem, i);
    }
    names.push_back(name);
  }
  return names;
}

// The coloured pictures have the names of the photos. In the same folder they would replace the
// photos or be taken for photos.
void RequireOtherFolder(const std::vector<LivePicture>& pictures, const fs::path& out) {
  for (const LivePicture& picture : pictures) {
    std::error_code none;
    if (picture.file.empty() ||
        !fs::equivalent(fs::absolute(picture.file).parent_path(), out, none))
      continue;
    throw InvalidArgument("-o {} is the folder of the photos; name another for the coloured ones",
                          out.string());
  }
}

}  // namespace

std::vector<LivePicture> CollectPictures(const Context& context,
                                         const std::vector<std::string>& arguments,
                                         const fs::path& out) {
  std::vector<LivePicture> pictures;
  for (const std::string& argument : arguments) {
    if (IsFolder(argument)) {
      AddFolder(context, argument, &pictures);
    } else if (IsFile(argument)) {
      pictures.push_back({fs::path(argument).filename().string(), argument, std::nullopt});
    } else {
      throw Error(ErrorCode::kNotFound, "there is no photo or folder {}", argument);
    }
  }
  RequireOtherFolder(pictures, out);
  return pictures;
}

nlohmann::ordered_json LiveSummary::ToJson() const {
  return {{"files", files},
          {"errors", errors},
          {"colorizer", colorizer},
          {"encoder_digest", encoder_digest},
          {"seconds", seconds},
          {"first_seconds", first_seconds}};
}

LiveSummary ColorizeToFiles(Connection& connection,
                            const LiveSource& source,
                            const std::vector<LivePicture>& pictures,
                            const LiveOptions& options,
                            const fs::path& out) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<std::string> names = OutputNames(pictures);
  std::vector<std::string> written(pictures.size());
  std::vector<std::string> errors(pictures.size());
  LiveSummary summary;
  const auto on_answer = [&](size_t i, const v1::ColorizeImagesResponse& answer) {
    const std::chrono::duration<double> now = std::chrono::steady_clock::now() - start;
    if (summary.first_seconds == 0.0) summary.first_seconds = now.count();
    if (answer.has_error()) {
      errors[i] = pictures[i].label + ": " + answer.error().message();
      if (summary.code == ExitCode::kOk) {
        summary.code =
            ExitCodeOf(ErrorCodeOf(static_cast<grpc::StatusCode>(answer.error().code())));
      }
      return;
    }
    const fs::path file = SafePathBelow(out, names[i]);
    if (answer.has_image_digest()) {
      const FileDigest digest{answer.image_digest().sha256(), answer.image_digest().size_bytes()};
      DownloadBlob(connection, digest, file, [](int64_t) {});
    } else {
      WriteFileAtomic(file, answer.image());
    }
    written[i] = names[i];
    summary.colorizer = answer.colorizer();
    summary.encoder_digest = answer.encoder_digest();
  };
  try {
    ColorizeLive(connection, source, pictures, options, on_answer);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kUnavailable) throw;
    const auto there =
        std::ranges::count_if(written, [](const std::string& name) { return !name.empty(); });
    throw Error(ErrorCode::kUnavailable,
                "{}; {} of {} pictures are complete in {}; run the command again for the rest",
                e.what(),
                there,
                pictures.size(),
                out.string());
  }
  for (size_t i = 0; i < pictures.size(); ++i) {
    if (!written[i].empty()) summary.files.push_back(written[i]);
    if (!errors[i].empty()) summary.errors.push_back(errors[i]);
  }
  const std::chrono::duration<double> all = std::chrono::steady_clock::now() - start;
  summary.seconds = all.count();
  return summary;
}

ExitCode PrintSummary(const Context& context, const LiveSummary& summary, const fs::path& out) {
  if (context.json) {
    nlohmann::ordered_json json = summary.ToJson();
    json["out"] = out.string();
    PrintJson(json);
  } else {
    PrintText(fmt::format("{} pictures in {}, {}{}\n",
                          summary.files.size(),
                          out.string(),
                          HumanSeconds(summary.seconds),
                          summary.colorizer.empty() ? "" : ", by " + summary.colorizer));
  }
  if (summary.errors.empty()) return ExitCode::kOk;
  std::string text = fmt::format("{} of {} pictures could not be coloured: ",
                                 summary.errors.size(),
                                 summary.errors.size() + summary.files.size());
  for (size_t i = 0; i < std::min(kShownErrors, summary.errors.size()); ++i) {
    text += (i > 0 ? "; " : "") + summary.errors[i];
  }
  if (summary.errors.size() > kShownErrors) {
    text += fmt::format("; and {} more", summary.errors.size() - kShownErrors);
  }
  if (!context.json) throw CommandFailure(summary.code, text);
  return summary.code;
}

}  // namespace color3d::client
