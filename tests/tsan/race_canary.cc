// Two threads write the same number without a lock, which a build for ThreadSanitizer must report.
#include <cstdio>
#include <thread>

namespace {

int number = 0;

void Write() {
  for (int i = 0; i < 100'000; ++i) number = number + 1;
}

}  // namespace

int main() {
  std::thread one(Write), other(Write);
  one.join();
  other.join();
  std::printf("%d\n", number);
  return 0;
}
