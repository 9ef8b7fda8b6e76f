"""What is kept of others' work is what they published."""

import hashlib
import pathlib
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Vendored(unittest.TestCase):
    def test_every_file_has_its_checksum(self):
        for folder in (ROOT / "third_party").iterdir():
            sums = dict(reversed(line.split()) for line in (folder / "SHA256SUMS").read_text().splitlines())
            files = {path.name for path in folder.iterdir()} - {"SHA256SUMS"}
            self.assertEqual(set(sums), files)
            for name, digest in sums.items():
                self.assertEqual(hashlib.sha256((folder / name).read_bytes()).hexdigest(), digest, name)

    def test_every_folder_is_in_the_copyright(self):
        text = (ROOT / "packaging" / "copyright").read_text()
        for folder in (ROOT / "third_party").iterdir():
            self.assertIn(f"Files: third_party/{folder.name}/*", text)


if __name__ == "__main__":
    unittest.main()
