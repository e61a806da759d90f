// The store that `serve --store` names.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "server/store/job_store.h"
#include "server/store/shared_job_logs.h"
#include "server/store/sql_job_store.h"

namespace color3d {

struct OpenedStore {
  std::unique_ptr<JobStore> store;
  std::string name;  // without password, for logs
  // Returns true if this server runs the chores that one of all servers runs. Outlived by `store`.
  std::function<bool()> has_chores;
  // Part of `store`; null: job logs are files of this server.
  SharedJobLogs* job_logs = nullptr;
};

// Opens the PostgreSQL database of `address`, or the SQLite file if it is empty, as a server, by
// the clocks of the database or of this machine. Throws Error{kInvalidArgument} for another
// address, Error{kFailedPrecondition} for a SQLite file on a network file system, and like the
// stores.
OpenedStore OpenStore(const std::string& address,
                      const std::filesystem::path& sqlite_file,
                      StoreOptions options);

// The same for a command of an operator, which neither creates nor migrates tables.
std::unique_ptr<JobStore> OpenStoreAsTool(const std::string& address,
                                          const std::filesystem::path& sqlite_file);

// Throws Error{kFailedPrecondition} if the folder is on a network file system, where SQLite would
// damage its file.
void RequireLocalFolder(const std::filesystem::path& folder);
// Returns the name of a network file system by the type that statfs gives; nullptr for others.
const char* NetworkFileSystem(int64_t type);

}  // namespace color3d
