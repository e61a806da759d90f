#include "server/access/certificate_roles.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

TEST(CertificateRolesTest, FirstMatchingLineDecides) {
  ScratchFolder scratch;
  const auto file = scratch.path() / "roles";
  WriteFileAtomic(file,
                  "# roles\n\nanna admin\n\"Bert Smith\" submit lab\n"
                  "guest.example.org read\nanna read\n");
  CertificateRoles roles(file);
  EXPECT_EQ(roles.Find({"anna"})->role, Role::kAdmin);
  EXPECT_EQ(roles.Find({"Bert Smith"})->project, "lab");
  EXPECT_EQ(roles.Find({"other.example.org", "guest.example.org"})->role, Role::kRead);
  EXPECT_FALSE(roles.Find({"nobody"}));
  EXPECT_FALSE(roles.Find({"*"}));
  EXPECT_FALSE(roles.Find({}));
}

TEST(CertificateRolesTest, StarMatchesAnyName) {
  ScratchFolder scratch;
  const auto file = scratch.path() / "roles";
  WriteFileAtomic(file, "anna admin\n* read\n");
  CertificateRoles roles(file);
  EXPECT_EQ(roles.Find({"anna"})->role, Role::kAdmin);
  EXPECT_EQ(roles.Find({"guest"})->role, Role::kRead);
  EXPECT_EQ(roles.Find({"guest"})->name, "guest");
}

TEST(CertificateRolesTest, NamesLineOfMistake) {
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      ParseCertificateRoles(text, "roles");
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(complaint("anna").find("line 1: expected NAME ROLE [PROJECT]"), std::string::npos);
  EXPECT_NE(complaint("\nanna king").find("line 2: there is no role 'king'"), std::string::npos);
  EXPECT_NE(complaint("Bert Smith read").find("line 1"), std::string::npos);
  EXPECT_NE(complaint("anna read LAB").find("is not a project name"), std::string::npos);
  ScratchFolder scratch;
  const auto file = scratch.path() / "roles";
  WriteFileAtomic(file, "* admin\n");
  ::chmod(file.c_str(), 0666);
  EXPECT_THROW(CertificateRoles{file}, Error) << "writable by others";
}

}  // namespace
}  // namespace color3d
