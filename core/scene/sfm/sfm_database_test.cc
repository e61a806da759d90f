#include "core/scene/sfm/sfm_database.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <string>
#include <thread>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/process/sandbox.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

// What COLMAP 3.8 writes of four photos, in the order in which its threads were ready.
class SfmDatabaseTest : public testing::Test {
 protected:
  SfmDatabaseTest() {
    Run("CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT NOT "
        "NULL UNIQUE, camera_id INTEGER NOT NULL, CHECK(image_id < 2147483647));"
        "CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY NOT NULL, data BLOB);"
        "CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY NOT NULL, data BLOB);"
        "INSERT INTO images VALUES (1, 'b', 1), (2, 'd', 1), (3, 'a', 1), (4, 'c', 1);"
        "INSERT INTO keypoints VALUES (1, 'kb'), (2, 'kd'), (3, 'ka');"
        "INSERT INTO descriptors VALUES (3, 'da'), (1, 'db'), (2, 'dd')");
  }
  fs::path file() const { return folder_.path() / "database.db"; }
  // Rows as "1|a 2|b ".
  std::string Run(const char* sql) {
    sqlite3* db = nullptr;
    EXPECT_EQ(sqlite3_open(file().c_str(), &db), SQLITE_OK);
    std::string rows;
    const auto add = [](void* to, int count, char** values, char**) {
      auto* text = static_cast<std::string*>(to);
      for (int i = 0; i < count; ++i) *text += std::string(i == 0 ? "" : "|") + values[i];
      *text += ' ';
      return 0;
    };
    EXPECT_EQ(sqlite3_exec(db, sql, add, &rows, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
    return rows;
  }
  ScratchFolder folder_;
};

TEST_F(SfmDatabaseTest, NumbersPhotosByName) {
  SfmDatabase(file()).NumberPhotosByName();
  EXPECT_EQ(Run("SELECT image_id, name FROM images ORDER BY image_id"), "1|a 2|b 3|c 4|d ");
  EXPECT_EQ(Run("SELECT image_id, data FROM keypoints ORDER BY image_id"), "1|ka 2|kb 4|kd ");
  EXPECT_EQ(Run("SELECT image_id, data FROM descriptors ORDER BY image_id"), "1|da 2|db 4|dd ");
  SfmDatabase database(file());
  EXPECT_EQ(database.ReadDescriptors("d"), "dd");
  EXPECT_EQ(database.ReadDescriptors("c"), "");
  EXPECT_EQ(database.ReadDescriptors("nothing"), "");
}

// As a worker: it may write beside the database and nowhere else.
TEST_F(SfmDatabaseTest, NeedsNoTemporaryFolder) {
  SandboxRules rules;
  rules.writable = {folder_.path()};
  const Sandbox sandbox(rules);
  std::string said;
  std::thread worker([&] {
    if (!sandbox.Enter()) {
      said = "no sandbox";
      return;
    }
    try {
      SfmDatabase(file()).NumberPhotosByName();
    } catch (const Error& e) {
      said = e.what();
    }
  });
  worker.join();
  EXPECT_EQ(said, "");
  EXPECT_EQ(Run("SELECT image_id, name FROM images WHERE image_id = 1"), "1|a ");
}

TEST_F(SfmDatabaseTest, RefusesOtherFiles) {
  WriteFileAtomic(file(), std::string(5000, 'x'));
  EXPECT_THROW(SfmDatabase(file()).NumberPhotosByName(), Error);
  EXPECT_THROW(SfmDatabase(folder_.path() / "none.db"), Error);
}

}  // namespace
}  // namespace color3d
