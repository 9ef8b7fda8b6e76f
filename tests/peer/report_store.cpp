// Makes a store to report on: FILE alone is a shift of three tools; FILE N has N results of one.

#include "support/report_store.hpp"

#include <cstdlib>
#include <string>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const std::string path = argv[1];
  if (argc > 2) {
    spindle::test::make_many(path, static_cast<std::size_t>(std::strtoull(argv[2], nullptr, 10)));
  } else {
    spindle::test::make_shift(path);
  }
  return 0;
}
