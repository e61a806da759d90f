#include "server/store/sqlite_connections.h"

#include <utility>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kMaxReaders = 4;

}  // namespace

SqliteConnections::SqliteConnections(const std::filesystem::path& file)
    : file_(file), writer_(file, SqliteAccess::kWrite) {}

std::unique_ptr<SqliteDatabase> SqliteConnections::AcquireReader() {
  const MutexLock lock(reading_);
  while (idle_readers_.empty() && readers_ >= kMaxReaders) reader_is_back_.Wait(reading_);
  if (idle_readers_.empty()) {
    auto fresh = std::make_unique<SqliteDatabase>(file_, SqliteAccess::kRead);
    ++readers_;
    return fresh;
  }
  std::unique_ptr<SqliteDatabase> reader = std::move(idle_readers_.back());
  idle_readers_.pop_back();
  return reader;
}

void SqliteConnections::ReleaseReader(std::unique_ptr<SqliteDatabase> reader) {
  {
    const MutexLock lock(reading_);
    idle_readers_.push_back(std::move(reader));
  }
  reader_is_back_.NotifyOne();
}

void SqliteConnections::RunRead(const Action& action) {
  std::unique_ptr<SqliteDatabase> db = AcquireReader();
  const std::shared_ptr<void> back(nullptr, [&](void*) { ReleaseReader(std::move(db)); });
  db->Exec("begin");
  const std::shared_ptr<void> end(nullptr, [&](void*) {
    try {
      db->Exec("rollback");
    } catch (const Error&) {
      // SQLite has ended the transaction by itself (I/O error).
    }
  });
  action(*db);
}

void SqliteConnections::RunWrite(const Action& action, bool durable) {
  const MutexLock lock(writing_);
  SqliteTransaction transaction(writer_, durable);
  action(writer_);
  transaction.Commit();
}

void SqliteConnections::Maintain(const std::function<void(SqliteDatabase&)>& action) {
  const MutexLock lock(writing_);
  action(writer_);
}

}  // namespace color3d
