#include "server/keeping_commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <memory>

#include "server/keeping/backup.h"
#include "server/keeping/fsck.h"
#include "server/serve_flags.h"
#include "server/store/postgresql/copy_store.h"

namespace color3d {
namespace {

// Returns exit status 1 if the copy lacks blobs, which are listed.
int ReportMissingBlobs(const CopiedBlobs& copied, const std::filesystem::path& from) {
  if (!copied.elsewhere.empty()) {
    std::cout << fmt::format(
        "its blobs are in {} and were not copied: keep versions or a replica of that bucket\n",
        copied.elsewhere);
  }
  for (const std::string& sha256 : copied.missing) std::cout << "missing: " << sha256 << "\n";
  for (const std::string& sha256 : copied.damaged) std::cout << "damaged: " << sha256 << "\n";
  for (const std::string& what : copied.unreadable) std::cout << "unreadable: " << what << "\n";
  if (copied.awaited > 0) {
    std::cout << fmt::format("{} files of uncommitted scenes were not uploaded yet\n",
                             copied.awaited);
  }
  if (copied.IsWhole()) return 0;
  if (!copied.unreadable.empty()) {
    std::cout
        << "change the owner or permissions of the unreadable files, or check the disk, and copy "
           "again\n";
  }
  if (copied.missing.empty() && copied.damaged.empty()) return 1;
  std::cout << fmt::format(
      "{} blobs of {} are missing and {} damaged, and left out of the copy: upload the files of "
      "their scenes again, or run their jobs again with skip_cache\n",
      copied.missing.size(),
      from.string(),
      copied.damaged.size());
  return 1;
}

int RunBackUp(const KeepingArguments& arguments) {
  const CopiedBlobs copied = BackUp(arguments.data_folder, arguments.copy);
  std::cout << fmt::format(
      "{}: {} blobs copied ({} MiB), {} kept{}\n",
      arguments.copy.string(),
      copied.copied,
      copied.bytes >> 20,
      copied.kept,
      copied.mended > 0 ? fmt::format("; {} damaged ones replaced", copied.mended) : "");
  return ReportMissingBlobs(copied, arguments.data_folder);
}

int RunRestore(const KeepingArguments& arguments) {
  const CopiedBlobs copied = Restore(arguments.copy, arguments.data_folder);
  std::cout << fmt::format("{}: {} blobs restored and verified; start color3d-server serve on it\n",
                           arguments.data_folder.string(),
                           copied.copied);
  return ReportMissingBlobs(copied, arguments.copy);
}

int RunFsck(const KeepingArguments& arguments) {
  const bool is_terminal = ::isatty(2) == 1;
  const auto progress = [&](int64_t blobs) {
    if (is_terminal && blobs % 100 == 0) std::cerr << "\r" << blobs << " blobs" << std::flush;
  };
  const std::unique_ptr<BlobStore> elsewhere =
      OpenBlobsAsTool(arguments.blobs, DataPaths(arguments.data_folder));
  const FsckResult result =
      Fsck(arguments.data_folder, arguments.address, elsewhere.get(), arguments.repair, progress);
  if (is_terminal) std::cerr << "\r";
  for (const std::string& problem : result.store_problems)
    std::cout << "jobs.db: " << problem << "\n";
  for (const std::string& sha256 : result.missing) std::cout << "missing: " << sha256 << "\n";
  for (const std::string& sha256 : result.damaged) std::cout << "damaged: " << sha256 << "\n";
  for (const std::string& what : result.unreadable) std::cout << "unreadable: " << what << "\n";
  std::cout << fmt::format(
      "{} blobs ({} MiB), {} unreferenced; {} missing, {} damaged, {} damaged and unreferenced, "
      "{} unreadable; {} of uncommitted scenes not uploaded yet\n",
      result.blobs,
      result.bytes >> 20,
      result.unnamed,
      result.missing.size(),
      result.damaged.size(),
      result.damaged_unnamed,
      result.unreadable.size(),
      result.awaited);
  if (!result.store_problems.empty()) {
    std::cout << "restore jobs.db from a backup (color3d-server restore)\n";
  } else if (result.missing.empty() && result.damaged.empty() && !result.unreadable.empty()) {
    std::cout << "change the owner or permissions of the unreadable files, or check the disk\n";
  } else if (!result.IsGood()) {
    std::cout << (arguments.repair ? "damaged blobs are set aside: "
                                   : "use --repair to set damaged blobs aside, then ")
              << "upload the files of the scene again, or run the jobs again with skip_cache\n";
  }
  return result.IsGood() ? 0 : 1;
}

int RunMigrate(const KeepingArguments& arguments) {
  const bool is_terminal = ::isatty(2) == 1;
  const CopiedStore copied =
      CopyToPostgresql(arguments.data_folder / "jobs.db",
                       arguments.address,
                       [&](const std::string& table, int64_t rows) {
                         if (is_terminal)
                           std::cerr << fmt::format("\r{}: {} rows   ", table, rows) << std::flush;
                       });
  if (is_terminal) std::cerr << "\r";
  std::cout << fmt::format(
      "{} scenes, {} jobs and {} events copied and verified; start color3d-server serve --store on "
      "it with the same blobs\n",
      copied.rows.at("scene"),
      copied.rows.at("job"),
      copied.rows.at("job_event"));
  return 0;
}

}  // namespace

void AddKeepingCommands(CLI::App* app, KeepingArguments* arguments) {
  const auto add = [&](const char* name, const char* what, int (*run)(const KeepingArguments&)) {
    CLI::App* command = app->add_subcommand(name, what);
    command->add_option("--data-dir", arguments->data_folder, "Data folder of the server")
        ->required();
    command->callback([arguments, run] { arguments->run = [=] { return run(*arguments); }; });
    return command;
  };
  add("backup", "Back up the store and all referenced files; the server may run", RunBackUp)
      ->add_option("FOLDER", arguments->copy, "Empty folder, or an earlier backup")
      ->required();
  add("restore", "Restore a backup to a new data folder", RunRestore)
      ->add_option("FOLDER", arguments->copy, "Folder of the backup")
      ->required();
  CLI::App* fsck = add("fsck", "Check a data folder; no server may use it", RunFsck);
  fsck->add_flag("--repair", arguments->repair, "Set damaged blobs aside");
  fsck->add_option("--store", arguments->address, "As for serve, if jobs are in PostgreSQL");
  AddBlobPlaceFlags(fsck, &arguments->blobs);
  add("migrate", "Copy the jobs of a data folder to PostgreSQL; the server may run", RunMigrate)
      ->add_option("--to",
                   arguments->address,
                   "postgresql://ROLE@HOST:PORT/DATABASE: empty, or a copy that no server has used")
      ->required();
}

}  // namespace color3d
