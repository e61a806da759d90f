#include "server/planning/asked_formats.h"

#include <gtest/gtest.h>

#include <string>

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;
using Formats = std::set<ExportFormat>;

TEST(AskedFormatsTest, DefaultsAreThoseOfTheTable) {
  EXPECT_EQ(AskedFormats({}), DefaultExportFormats());
}

TEST(AskedFormatsTest, SogAndSplat4dFollowTheOthers) {
  v1::ExportSpec spec;
  spec.set_ply(false);
  EXPECT_EQ(AskedFormats(spec), Formats());
  spec.set_splat(true);
  EXPECT_EQ(AskedFormats(spec), (Formats{ExportFormat::kSplat, ExportFormat::kSplat4d}));
}

TEST(AskedFormatsTest, EveryFormatCanBeAskedForAlone) {
  for (const ExportFormatInfo& info : kExportFormats) {
    v1::ExportSpec spec;
    spec.set_ply(false);
    spec.set_splat4d(false);
    const FieldDescriptor* field = spec.GetDescriptor()->FindFieldByName(info.option);
    ASSERT_NE(field, nullptr) << info.option;
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) {
      spec.GetReflection()->SetBool(&spec, field, true);
    } else {
      spec.GetReflection()->SetInt32(&spec, field, 3);
    }
    EXPECT_TRUE(AskedFormats(spec).contains(info.format)) << info.option;
  }
}

// An option of ExportSpec is a format or says how one is written.
TEST(AskedFormatsTest, EveryOptionIsAFormatOrAProperty) {
  const auto* options = v1::ExportSpec::descriptor();
  for (int i = 0; i < options->field_count(); ++i) {
    const std::string& name = options->field(i)->name();
    if (name == "confidence" || name == "spz_version") continue;
    bool is_format = false;
    for (const ExportFormatInfo& info : kExportFormats) is_format |= name == info.option;
    EXPECT_TRUE(is_format) << name << " has no row in core/catalogue/export_formats.h";
  }
}

}  // namespace
}  // namespace color3d
