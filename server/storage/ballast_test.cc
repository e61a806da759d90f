#include "server/storage/ballast.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/service/storage_fixture.h"

namespace color3d {
namespace {

TEST_F(StorageTest, BallastReservesSpaceUntilReleased) {
  const auto file = scratch_.path() / "ballast";
  Ballast ballast(file, 1 << 20);
  EXPECT_FALSE(ballast.IsThere());
  EXPECT_FALSE(ballast.Release());
  EXPECT_TRUE(ballast.Make());
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_GE(status.st_blocks * 512, 1 << 20) << "a file with holes takes nothing";
  EXPECT_TRUE(Ballast(file, 1 << 20).IsThere()) << "the next server has it, too";
  EXPECT_TRUE(ballast.Release());
  EXPECT_FALSE(ballast.IsThere());
}

TEST_F(StorageTest, RetriesDeletionAfterMakingRoom) {
  int tries = 0, rooms = 0;
  const auto full_at_first = [&] {
    if (++tries == 1) throw ServiceError(ErrorReason::kStorageFull, "full");
    return tries;
  };
  const std::function<bool()> make_room = [&] { return ++rooms == 1; };
  EXPECT_EQ(RetryAfterMakingRoom(make_room, full_at_first), 2);
  tries = 0;
  EXPECT_EQ(ReasonThrown([&] { RetryAfterMakingRoom(make_room, full_at_first); }), "STORAGE_FULL")
      << "there is none left";
  EXPECT_EQ(ReasonThrown([&] {
              RetryAfterMakingRoom(make_room, [] { throw Error(ErrorCode::kNotFound, "no"); });
            }),
            "NOT_FOUND");
  EXPECT_EQ(rooms, 2) << "nothing is given up for another reason";
}

}  // namespace
}  // namespace color3d
