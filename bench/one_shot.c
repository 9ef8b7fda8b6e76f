/* The bare minimum that spindle's one-shot reading is compared with: connect, read holding
 * registers 2 and 3, print them. usage: one_shot PORT */
#include <errno.h>
#include <modbus.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

int main(int count, char** arguments) {
  if (count != 2) {
    fputs("usage: one_shot PORT\n", stderr);
    return 2;
  }
  modbus_t* tool = modbus_new_tcp("127.0.0.1", atoi(arguments[1]));
  uint16_t words[2] = {0, 0};
  if (tool == NULL || modbus_connect(tool) != 0 || modbus_read_registers(tool, 2, 2, words) != 2) {
    fprintf(stderr, "one_shot: %s\n", modbus_strerror(errno));
    return 1;
  }
  printf("%u %u\n", (unsigned)words[0], (unsigned)words[1]);
  modbus_close(tool);
  modbus_free(tool);
  return 0;
}
