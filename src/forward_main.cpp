#include "program.hpp"
#include "spindle/forward/forward.hpp"

int main(int count, char** arguments) {
  return spindle::run_program(count, arguments, {.forward = spindle::forward::run});
}
