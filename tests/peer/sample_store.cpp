// Makes a store for tests that run the program itself: FILE alone is the sample of
// tests/support/sample_store.hpp; with FROM and TO one tool tells these numbers, as if while it is
// read.
#include "support/sample_store.hpp"

#include <string>

#include "spindle/posix/disk.hpp"

int main(int count, char** arguments) {
  using namespace spindle;
  if (count != 2 && count != 4) return 2;
  const files::ProfileStore profiles({std::string(SPINDLE_SOURCE_DIR) + "/profiles"},
                                     posix::source_disk());
  if (count == 2) {
    test::make_sample_store(arguments[1], profiles);
    return 0;
  }
  test::StoreMaker maker(arguments[1], profiles);
  maker.connect("busy", "5", "doga-bm");
  for (int number = std::stoi(arguments[2]); number <= std::stoi(arguments[3]); ++number) {
    maker.wait(std::chrono::seconds(number));
    maker.tell(static_cast<std::uint16_t>(number), {{"torque", 271}, {"status", 1}});
  }
  return 0;
}
