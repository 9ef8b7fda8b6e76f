#include "program.hpp"
#include "spindle/page/page.hpp"

int main(int count, char** arguments) {
  return spindle::run_program(count, arguments, {.page = spindle::page::run});
}
