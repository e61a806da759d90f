#include "server/store/store_file.h"

#include "core/base/error.h"
#include "server/store/sqlite_db.h"

namespace color3d {
namespace fs = std::filesystem;

void RequireStore(const fs::path& file) {
  std::error_code error;
  if (fs::is_regular_file(file, error)) return;
  throw Error(ErrorCode::kFailedPrecondition,
              "{} holds no {}",
              file.parent_path().string(),
              file.filename().string());
}

void CopyStore(const fs::path& file, const fs::path& copy) {
  std::error_code error;
  fs::remove(copy, error);
  SqliteDatabase(file, SqliteAccess::kWrite).Run("vacuum into ?", copy.string());
}

void DropCheckpoint(const fs::path& file, const std::string& sha256) {
  SqliteDatabase(file, SqliteAccess::kWrite)
      .Run("update job set checkpoint_sha256='', checkpoint_bytes=0 where checkpoint_sha256=?",
           sha256);
}

std::vector<std::string> StoreProblems(const fs::path& file) {
  std::vector<std::string> problems;
  SqliteDatabase db(file, SqliteAccess::kRead);
  SqlStatement integrity(db, "pragma integrity_check(20)");
  while (integrity.Step()) {
    if (integrity.Text(0) != "ok") problems.push_back(integrity.Text(0));
  }
  SqlStatement references(db, "pragma foreign_key_check");
  while (references.Step()) {
    problems.push_back("a row of " + references.Text(0) + " names a " + references.Text(2) +
                       " that is not there");
  }
  return problems;
}

}  // namespace color3d
