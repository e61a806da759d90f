// Commands of operators on stored data: `color3d-server backup`, `restore`, `fsck` and `migrate`.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>

#include "server/blob_place.h"

namespace color3d {

struct KeepingArguments {
  std::filesystem::path data_folder, copy;
  std::string address;  // of a PostgreSQL store
  BlobPlaceOptions blobs;
  bool repair = false;
  // Runs the parsed command and returns its exit status; empty: it is another one.
  std::function<int()> run;
};

// `arguments` must outlive `app`.
void AddKeepingCommands(CLI::App* app, KeepingArguments* arguments);

}  // namespace color3d
