#include "server/store/sqlite_job_store.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <utility>

namespace color3d {
namespace {

std::shared_ptr<SqliteConnections> Prepared(const std::filesystem::path& file,
                                            StoreRole role,
                                            const StoreOptions& options) {
  PrepareStore(file, role, {options.program_version, options.boot_id});
  return std::make_shared<SqliteConnections>(file);
}

}  // namespace

SqliteJobStore::SqliteJobStore(const std::filesystem::path& file,
                               StoreRole role,
                               Clocks clocks,
                               StoreOptions options)
    : SqliteJobStore(Prepared(file, role, options), file, std::move(clocks), options) {}

SqliteJobStore::SqliteJobStore(std::shared_ptr<SqliteConnections> connections,
                               const std::filesystem::path& file,
                               Clocks clocks,
                               const StoreOptions& options)
    : SqlJobStore(connections, std::move(clocks), options),
      file_(file),
      connections_(std::move(connections)) {}

// Works in steps with a short log: a nearly full disk has no room for a long one.
int64_t SqliteJobStore::ReturnFreeSpace(int64_t keep_bytes) {
  constexpr int64_t kPagesAtOnce = 500;
  int64_t free_bytes = 0;
  connections_->Maintain([&](SqliteDatabase& db) {
    const auto number = [&](const char* pragma) { return SqlStatement(db, pragma).NextInt(); };
    const int64_t page_bytes = number("pragma page_size");
    const int64_t keep = keep_bytes / page_bytes;
    int64_t free = number("pragma freelist_count");
    for (int step = 0; step < 4 && free > keep; ++step) {
      db.Run(fmt::format("pragma incremental_vacuum({})", std::min(kPagesAtOnce, free - keep)));
      // The checkpoint truncates the file; concurrent readers delay it.
      db.Run("pragma wal_checkpoint(passive)");
      free = number("pragma freelist_count");
    }
    free_bytes = free * page_bytes;
  });
  return free_bytes;
}

}  // namespace color3d
