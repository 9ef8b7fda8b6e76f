"""Frames of serial lines, for the tests of this folder and for those with other people's programs."""

import struct


def with_checksum(frame):
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return frame + struct.pack("<H", crc)


def rtu_requests(data):
    """The frames in what a bus heard at once: one that the machine kept from listening hears several. Reads,
    loop-backs and writes of one register have eight bytes, writes of several say their length."""
    while data:
        length = 9 + data[6] if data[1] == 0x10 and len(data) > 6 else 8
        yield data[:length]
        data = data[length:]
