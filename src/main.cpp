#include "program.hpp"

int main(int count, char** arguments) { return spindle::run_program(count, arguments, {}); }
