#include "tests/support/service/test_store.h"

#include <cstdlib>
#include <map>
#include <string_view>

#include "server/store/open_store.h"
#include "server/store/postgresql/postgresql_db.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_job_store.h"
#include "tests/support/service/postgresql_cluster.h"

namespace color3d::testing {
namespace fs = std::filesystem;

bool TestsUsePostgresql() {
  const char* kind = std::getenv("COLOR3D_TEST_STORE");
  return kind != nullptr && std::string_view(kind) == "postgresql";
}

std::string TestStoreAddress(const fs::path& data_folder) {
  static std::map<fs::path, std::string> addresses;
  if (!TestsUsePostgresql()) return {};
  std::string& address = addresses[data_folder.lexically_normal()];
  if (address.empty()) address = PostgresqlCluster::Shared().NewDatabase();
  return address;
}

std::unique_ptr<JobStore> OpenTestStore(const fs::path& file) {
  return OpenStore(TestStoreAddress(file), file, {}).store;
}

std::unique_ptr<SqlDatabase> OpenTestDatabase(const fs::path& data_folder) {
  if (TestsUsePostgresql()) {
    return std::make_unique<PostgresqlDatabase>(TestStoreAddress(data_folder));
  }
  return std::make_unique<SqliteDatabase>(data_folder / "jobs.db", SqliteAccess::kWrite);
}

void RestartTestDatabase() {
  PostgresqlCluster::Shared().Kill();
  PostgresqlCluster::Shared().Start();
}

}  // namespace color3d::testing
