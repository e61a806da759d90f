// Places of each RPC, as listed in CONTRIBUTING.md. AccessTest.EveryRpcRequiresRole
// covers its service and its role.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>

#include "core/base/files.h"
#include "tests/support/service/rpc_methods.h"

namespace color3d::testing {
namespace {
namespace fs = std::filesystem;

const fs::path kSources = COLOR3D_SOURCE_DIR;

bool IsTest(const fs::path& file) { return file.string().ends_with("_test.cc"); }

// All sources of the folder, tests or others, in one text.
std::string ReadSources(const fs::path& folder, bool tests) {
  std::string text;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".cc" || IsTest(entry.path()) != tests) continue;
    if (entry.path().filename() != "access_test.cc") text += ReadFile(entry.path());
  }
  return text;
}

// A call of a stub, or the address of its method.
bool Calls(const std::string& text, const std::string& method) {
  return std::regex_search(text, std::regex("(->|\\.|::)" + method + "\\b"));
}

TEST(RpcPlacesTest, ClientCallsEveryRpc) {
  const std::string client = ReadSources(kSources / "client", /*tests=*/false);
  for (const auto* method : AllRpcMethods(kSources / "proto")) {
    EXPECT_TRUE(Calls(client, method->name())) << method->full_name();
  }
}

TEST(RpcPlacesTest, EveryRpcHasATestBesideItsService) {
  const std::string tests = ReadSources(kSources / "server/rpc", /*tests=*/true);
  for (const auto* method : AllRpcMethods(kSources / "proto")) {
    EXPECT_TRUE(Calls(tests, method->name())) << method->full_name();
  }
}

TEST(RpcPlacesTest, ReferenceDescribesEveryRpc) {
  const std::string reference = ReadFile(kSources / "proto/README.md");
  for (const auto* method : AllRpcMethods(kSources / "proto")) {
    if (method->file()->package() != "color3d.v1") continue;  // described by Google
    const size_t row = reference.find("| `" + method->name() + "(");
    ASSERT_NE(row, std::string::npos) << method->full_name();
    EXPECT_EQ(reference.substr(row, reference.find('\n', row) - row).find("|  |"),
              std::string::npos)
        << method->full_name() << " has no comment";
  }
}

}  // namespace
}  // namespace color3d::testing
