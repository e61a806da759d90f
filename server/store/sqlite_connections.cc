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

// The members of a scoped capability are not analysed.
SqliteConnections::Writer::Writer(SqliteConnections& connections) COLOR3D_NO_THREAD_SAFETY_ANALYSIS
    : lock_(connections.writing_),
      db_(connections.writer_) {}

SqliteConnections::Writer::~Writer() COLOR3D_NO_THREAD_SAFETY_ANALYSIS = default;

SqliteConnections::Reader::Reader(SqliteConnections& connections)
    : connections_(connections), db_(connections.AcquireReader()) {
  try {
    db_->Exec("begin");
  } catch (...) {
    connections_.ReleaseReader(std::move(db_));
    throw;
  }
}

SqliteConnections::Reader::~Reader() {
  try {
    db_->Exec("rollback");
  } catch (const Error&) {
    // SQLite has ended the transaction by itself (I/O error).
  }
  connections_.ReleaseReader(std::move(db_));
}

}  // namespace color3d
