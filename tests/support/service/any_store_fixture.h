// Fixture of the conformance tests: every case runs with each kind of store.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/store/postgresql/postgresql_job_store.h"
#include "tests/support/service/job_store_fixture.h"
#include "tests/support/service/postgresql_cluster.h"

namespace color3d {

enum class StoreKind { kSqlite, kPostgresql };

// PostgreSQL only where its programs are installed; StoresTest.PostgresqlIsTested tells.
inline std::vector<StoreKind> StoresToTest() {
  if (!testing::PostgresqlCluster::IsInstalled()) return {StoreKind::kSqlite};
  return {StoreKind::kSqlite, StoreKind::kPostgresql};
}
inline std::string NameOfStore(StoreKind kind) {
  return kind == StoreKind::kSqlite ? "Sqlite" : "Postgresql";
}
inline std::string StoreName(const ::testing::TestParamInfo<StoreKind>& info) {
  return NameOfStore(info.param);
}
#define COLOR3D_FOR_ALL_STORES(suite) \
  INSTANTIATE_TEST_SUITE_P(Stores, suite, ::testing::ValuesIn(StoresToTest()), StoreName)

class AnyStoreFixture : protected JobStoreFixture {
 protected:
  // Must be called by the constructor.
  void BeginWith(StoreKind kind) {
    if (kind == StoreKind::kPostgresql) {
      address_ = testing::PostgresqlCluster::Shared().NewDatabase();
    }
    Begin();
  }
  std::unique_ptr<SqlJobStore> MakeStore(StoreRole role, const StoreOptions& options) override {
    if (address_.empty()) {
      return std::make_unique<SqliteJobStore>(File(), role, TestClocks(), options);
    }
    return std::make_unique<PostgresqlJobStore>(address_, role, TestClocks(), options);
  }

  std::string address_;  // of the PostgreSQL database
};

class AnyStoreTest : public AnyStoreFixture, public ::testing::TestWithParam<StoreKind> {
 protected:
  AnyStoreTest() { BeginWith(GetParam()); }
};

}  // namespace color3d
