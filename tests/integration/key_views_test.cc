// Several key views, through the whole service.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {

using nlohmann::json;

class KeyViewsTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }

  std::string Truth(const std::string& photo) const {
    return (Path("room") / "truth" / photo).string();
  }
  json Result(const std::string& out, const std::string& name) const {
    return json::parse(ReadFile(Path(out) / name));
  }
};

// Larger than what the colorizer trains on, so that carried colours and their confidences, which
// are 1 in the further key views, are reduced on the way (334 px to 267: the mean of ones rounds to
// above 1).
TEST_F(KeyViewsTest, ThreeKeyViewsGoThrough) {
  ProceduralSceneOptions room = SmallRoom(6, /*gray=*/true);
  room.width = 500;
  room.height = 334;
  WriteProceduralScene(Path("room"), room);
  const ProcessResult result = Client({"colorize",
                                       Path("room").string(),
                                       "-o",
                                       Path("out").string(),
                                       "--key-color",
                                       Truth("view002.png"),
                                       "--more-key",
                                       "view000.png=" + Truth("view000.png"),
                                       "--more-key",
                                       "view005=" + Truth("view005.png"),
                                       "--max-side",
                                       "500",
                                       "--max-gaussians",
                                       "15000",
                                       "--geometry-iterations",
                                       "150",
                                       "--colorizer-iterations",
                                       "10",
                                       "--chroma-iterations",
                                       "10"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(NewestJob("carry_color").spec().carry_color().further_key_views_size(), 2);
}

}  // namespace
}  // namespace color3d
