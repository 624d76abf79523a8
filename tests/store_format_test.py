"""A second reader of the .tlod format, written from docs/FORMAT.md alone: it reads the golden file down to the last
byte, finds every changed one, and prints the worked example of that page (--listing)."""

import os
import re
import struct
import sys
import unittest

SOURCE = os.environ.get("TETRALOD_SOURCE") or os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
GOLDEN = os.path.join(SOURCE, "tests", "golden", "store_v1.tlod")
FORMAT = os.path.join(SOURCE, "docs", "FORMAT.md")
NONE = 0xFFFFFFFF
MASK = (1 << 64) - 1
A, B, C, D = 0x6A09E667F3BCC909, 0xBB67AE8584CAA73B, 0x3C6EF372FE94F82B, 0xA54FF53A5F1D36F1
TYPES = {"u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q", "i32": "<i", "i64": "<q", "f64": "<d"}


def align(count):
    return (count + 7) // 8 * 8


def mix(x):
    x = (x ^ x >> 32) * C & MASK
    x = (x ^ x >> 29) * D & MASK
    return x ^ x >> 32


def checksum(seed, data):
    lanes = [seed ^ A, seed ^ B, seed ^ C, seed ^ D]
    padded = data + bytes(align(len(data)) - len(data))
    for i in range(0, len(padded), 8):
        n = i // 8 % 4
        x = (lanes[n] ^ int.from_bytes(padded[i:i + 8], "little")) * B & MASK
        lanes[n] = (x << 29 | x >> 35) & MASK
    h = seed ^ len(data) * A & MASK
    for lane in lanes:
        h = mix(h ^ lane)
    return h


def seed(identity, part, a=0, b=0):
    return mix(mix(identity ^ part) ^ (a << 32 | b))


def code16(code, unit):
    e, m = code >> 10, code & 1023
    if code == 0xFFFF:
        return float("inf")
    return (1024 + m) * 2.0 ** (e + unit - 72) if e else m * 2.0 ** (unit - 71)


def code8(code, unit):
    e, m = code >> 3, code & 7
    if code == 0xFF:
        return float("inf")
    return (8 + m) * 2.0 ** (e + unit - 33) if e else m * 2.0 ** (unit - 32)


class Damaged(Exception):
    pass


def demand(condition, what):
    if not condition:
        raise Damaged(what)


class Reader:
    """Walks over the bytes; every one is taken once. lines: the worked example."""

    def __init__(self, data):
        self.data, self.at, self.lines, self.decoded = data, 0, [], {}
        self.head()
        self.pages()
        demand(self.at == len(data), "bytes behind the end")

    def title(self, text):
        self.lines.append(("", "", text))

    def take(self, kind, what):
        size = struct.calcsize(TYPES[kind])
        demand(self.at + size <= len(self.data), "cut short")
        value = struct.unpack_from(TYPES[kind], self.data, self.at)[0]
        shown = "none" if value == NONE and kind == "u32" else f"{value:#x}" if what.startswith(("checksum", "identity")) else f"{value:.9g}" if kind == "f64" else value
        self.bytes(size, f"{kind} {what}: {shown}")
        return value

    def bytes(self, count, what):
        demand(self.at + count <= len(self.data), "cut short")
        data = self.data[self.at:self.at + count]
        for i in range(0, count, 16):
            self.lines.append((f"{self.at + i:04x}", data[i:i + 16].hex(" "), what if i == 0 else ""))
        self.at += count
        return data

    def zeros(self, count, what="zeros"):
        if not count:
            return
        demand(not any(self.data[self.at:self.at + count]), f"{what} that are not zero")
        demand(self.at + count <= len(self.data), "cut short")
        self.lines.append((f"{self.at:04x}", "00 ..." if count > 16 else "00 " * count, f"{what}, {count} bytes"))
        self.at += count

    def nought(self, kind="u32"):
        demand(self.take(kind, "reserved") == 0, "a reserved byte that is not zero")

    # ---- head ----

    def head(self):
        self.title("Head")
        demand(self.bytes(8, "what a .tlod file begins with") == b"\x89TLOD\r\n\x1a", "no .tlod file")
        demand(self.take("u32", "version") == 1, "an unknown version")
        demand(self.take("u32", "flags") == 0, "unknown flags")
        demand(self.take("u64", "bytes of the file") == len(self.data), "another size than the head says")
        head_bytes = self.take("u64", "bytes of the head")
        demand(head_bytes % 8 == 0 and 440 <= head_bytes <= len(self.data), "a head that can't be")
        self.identity = self.take("u64", "identity")
        hashed = self.data[:head_bytes - 8]
        demand(checksum(seed(self.identity, 1), hashed) == struct.unpack_from("<Q", self.data, head_bytes - 8)[0], "a wrong checksum of the head")
        names = ("levels", "segments", "patches", "root patches", "channels", "pages", "bytes of tables", "regions listed", "kinds of cells listed")
        (self.level_count, self.segment_count, self.patch_count, self.roots, self.channel_count, page_count, table_bytes, region_count,
         cell_kinds) = [self.take("u32", n) for n in names]
        self.nought()
        self.take("u32", "kind of places")
        self.take("i32", "lattice: exponent")
        for axis in "xyz":
            self.take("i64", f"lattice: origin {axis}")
        self.take("u64", "tets of the input")
        self.take("u64", "vertices of the input")
        for name in ("x0", "x1", "y0", "y1", "z0", "z1", "diagonal", "volume", "boundary area", "smallest mean ratio", "median mean ratio",
                     "smallest dihedral angle", "largest dihedral angle"):
            self.take("f64", name)
        for name in ("inverted tets", "flat tets", "vertices not finite", "vertices of no tet", "vertices at the place of another",
                     "boundary triangles", "interface triangles", "components", "non-manifold faces", "non-manifold edges", "non-manifold vertices"):
            self.take("u64", name)
        for name in ("time", "most that coding moves a vertex", "part of vertices on borders", "bits: connectivity", "bits: places", "bits: flags", "bits: regions"):
            self.take("f64", name)
        self.take("u64", "regions")
        self.topology_bytes = self.take("u64", "bytes of topology blobs")
        self.sphere_lo = [self.take("f64", f"spheres: lo {axis}") for axis in "xyz"]
        self.sphere_step = self.take("f64", "spheres: step")
        self.length_unit = self.take("i32", "unit of lengths")
        self.nought()
        self.lists(cell_kinds, region_count)
        self.levels()
        self.channels()
        self.bytes(table_bytes, "tables of the coder")
        self.zeros(align(table_bytes) - table_bytes)
        self.directory(page_count)
        self.take("u64", "checksum of the head")
        demand(self.at == head_bytes, "a head of another size")

    def lists(self, cell_kinds, region_count):
        for kind in range(cell_kinds):
            self.take("u64", f"cells of kind {kind}")
        for _ in range(region_count):
            self.title("Region")
            self.take("i64", "id")
            self.take("u64", "tets")
            size = self.take("u32", "bytes of the name")
            self.nought()
            self.bytes(size, "name")
            self.zeros(align(self.at) - self.at)

    def levels(self):
        self.level_tets, self.level_patches, segments = [], [], []
        for level in range(self.level_count):
            self.title(f"Level {level}")
            self.level_tets.append(self.take("u64", "tets"))
            self.take("u64", "vertices")
            self.level_patches.append(self.take("u32", "patches"))
            segments.append(self.take("u32", "segments"))
            self.take("f64", "boundary error")
            for c in range(self.channel_count):
                self.take("f64", f"largest error of channel {c}")
        demand(sum(segments) == self.segment_count and sum(self.level_patches) == self.patch_count, "counts that do not add up")
        self.segment_level = [level for level in reversed(range(self.level_count)) for _ in range(segments[level])]

    def channels(self):
        self.channel = []
        for c in range(self.channel_count):
            self.title(f"Channel {c}")
            name_bytes, unit_bytes = self.take("u32", "bytes of the name"), self.take("u32", "bytes of the unit")
            components, on = self.take("u32", "components"), self.take("u8", "on")
            for name in ("type", "kind of values"):
                self.take("u8", name)
            self.nought("u8")
            time = [self.take("f64", name) for name in ("step", "range: from", "range: to", "most that coding changes a value", "time")][-1]
            self.take("u64", "values not finite")
            size = self.take("u64", "bytes of blobs")
            unit = self.take("i32", "unit of errors")
            step_number = self.take("u32", "step + 1")
            lo, step = self.take("f64", "ranges: lo"), self.take("f64", "ranges: step")
            begin = self.at
            self.bytes(name_bytes, "name")
            name = self.data[begin:self.at].decode()
            self.bytes(unit_bytes, "unit")
            self.zeros(align(self.at) - self.at)
            self.channel.append({"name": name, "number": step_number - 1 if step_number else None, "time": time, "bytes": size, "components": components, "on": on, "unit": unit, "lo": lo, "step": step})

    def directory(self, page_count):
        self.page = []
        for p in range(page_count):
            self.title(f"Entry of page {p}")
            names = (("u64", "payload"), ("u64", "page"), ("u64", "checksum"), ("u32", "bytes"), ("u32", "first segment"), ("u32", "first patch"))
            self.page.append({name: self.take(kind, name) for kind, name in names})
            self.nought()

    # ---- pages ----

    def pages(self):
        self.producer, self.inputs, self.outputs, self.carried, sums = {}, {}, {}, {}, [0] * (self.channel_count + 1)
        for p, page in enumerate(self.page):
            following = self.page[p + 1] if p + 1 < len(self.page) else {"first segment": self.segment_count, "first patch": self.patch_count}
            groups = None
            if p:  # the payload comes first; its sizes stand in the page behind it
                payload_at, self.at = self.at, page["page"]
                demand(payload_at == page["payload"], "a gap before a payload")
            demand(self.at == page["page"], "a gap before a page")
            demand(checksum(seed(self.identity, 2, p), self.data[self.at:self.at + page["bytes"]]) == page["checksum"], "a wrong checksum of a page")
            groups = self.one_page(p, page, following, sums)
            if p:
                end, self.at = self.at, payload_at
                self.payload(groups)
                demand(self.at == page["page"], "a payload that does not fill its place")
                self.at = end
            else:
                self.zeros(page["payload"] - self.at, "zeros up to the payload")
                self.payload(groups)
        demand(sums == [self.topology_bytes] + [c["bytes"] for c in self.channel], "other bytes of blobs than the head says")
        for segment, outputs in self.outputs.items():
            demand(all(self.producer[o] == segment for o in outputs), "an output with another producer")
            demand(sum(self.carried[o] for o in outputs) == sum(self.carried[i] for i in self.inputs[segment]), "vertices that are not handed on")
        demand(sum(map(len, self.outputs.values())) == sum(p != NONE for p in self.producer.values()), "a patch that is no output")

    def sphere(self):
        centre = [self.sphere_lo[k] + self.take("u32", f"centre {'xyz'[k]}") * self.sphere_step for k in range(3)]
        radius = code16(self.take("u16", "radius"), self.length_unit)
        self.note(f"sphere {' '.join(f'{x:.6g}' for x in centre)}, radius {radius:.6g}")

    def note(self, text):
        self.lines.append(("", "", f"    = {text}"))

    def bins(self, name, unit):
        first, count = self.take("u8", f"{name}: first bin"), self.take("u8", f"{name}: bins")
        demand(first + count <= 64 and (count or not first), "bins that can't be")
        codes = [self.take("u8", f"{name}, bin {first + i}") for i in range(count)]
        demand(not codes or (codes[0] and codes[-1]), "bins that are zero at an end")
        if codes:
            self.note(" ".join(f"{code8(c, unit):.6g}" for c in codes))

    def one_page(self, p, page, following, sums):
        begin = self.at
        self.title(f"Page {p}")
        counts = [self.take("u32", name) for name in ("segments", "patches", "outputs", "bytes of bins")]
        demand(counts[0] == following["first segment"] - page["first segment"] and counts[1] == following["first patch"] - page["first patch"], "other counts")
        segments, first_segment, first = [], page["first segment"], page["first patch"]
        for s in range(counts[0]):
            self.title(f"Segment {first_segment + s}")
            inputs, outputs = self.take("u32", "inputs"), self.take("u32", "outputs")
            self.take("u64", "tets of the outputs")
            self.sphere()
            self.note(f"{code16(self.take('u16', 'boundary error'), self.length_unit):.6g}")
            for c in range(self.channel_count):
                self.note(f"{code16(self.take('u16', f'largest error of channel {c}'), self.channel[c]['unit']):.6g}")
            segments.append((inputs, outputs))
        self.title("Outputs and bins")
        for s, (_, count) in enumerate(segments):
            self.outputs[first_segment + s] = [self.take("u32", f"output of segment {first_segment + s}") for _ in range(count)]
        for s in range(counts[0]):
            for c in range(self.channel_count):
                self.bins("field", self.channel[c]["unit"])
                self.bins("space", self.length_unit)
        groups, at = [], first
        roots = max(0, min(self.roots - first, counts[1]))
        for s, count in [(None, roots)] + [(first_segment + s, n[0]) for s, n in enumerate(segments)]:
            groups.append([self.patch(at + i, s, sums) for i in range(count)])
            if s is not None:
                self.inputs[s] = range(at, at + count)
            at += count
        demand(at == first + counts[1], "patches of no group")
        self.zeros(begin + page["bytes"] - self.at, "padding of the page")
        return groups

    def patch(self, number, consumer, sums):
        self.title(f"Patch {number}")
        producer = self.producer[number] = self.take("u32", "producer")
        sizes = [self.take("u32", "bytes of the topology")]
        self.carried[number] = self.take("u64", "original vertices")
        counts = self.take("u32", "tets"), self.take("u16", "vertices")
        raw = self.take("u8", "class") == 255
        level = self.take("u8", "level")
        self.sphere()
        flags = self.take("u16", "flags")
        demand(flags <= 1, "unknown flags of a patch")
        demand(consumer is None or self.segment_level[consumer] == level, "another level than the consumer")
        demand(producer == NONE or (self.segment_level[producer] < level and (consumer is None or producer > consumer)), "a producer that is not finer")
        for c, channel in enumerate(self.channel):
            sizes.append(self.take("u32", f"channel {c}: bytes"))
            ends = [self.take("u16", f"channel {c}: range {word}") for word in ("from", "to")]
            self.note(" .. ".join(f"{channel['lo'] + (k - 1) * channel['step']:.6g}" for k in ends))
            root = code16(self.take("u16", f"channel {c}: root of the squares"), channel["unit"] + 24)
            self.note(f"{root:.6g}, squares {root * root:.6g}")
        for i, size in enumerate(sizes):
            sums[i] += size
        return number, sizes, flags, counts if raw else None

    # ---- payload ----

    def payload(self, groups):
        for group in groups:
            for part in range(self.channel_count + 1):
                for number, sizes, flags, counts in group:
                    self.blob(number, sizes[part], NONE if part == 0 else part - 1, flags, counts)

    def raw_channel(self, data, channel, counts):
        demand(data[0] == 0 and data[1] & ~4 == 0, "a raw channel that can't be")
        count = self.channel[channel]["components"] * counts[1 - self.channel[channel]["on"]]
        return struct.unpack(f"<{count}{'q' if data[1] & 4 else 'i'}", data[2:])

    def blob(self, number, size, channel, flags, counts):
        begin, twins = self.at, 0
        self.title(f"Patch {number}, {'topology' if channel == NONE else f'channel {channel}'}")
        if channel == NONE and flags & 1:
            twins = struct.unpack_from("<H", self.data, begin + size - 2)[0]
        data = self.bytes(size - (3 * twins + 2 if twins else 0), "the codec's")
        if counts:
            self.decoded[number, channel] = self.raw_channel(data, channel, counts) if channel != NONE else raw_topology(data, counts)
        for _ in range(twins):
            self.take("u16", "twin: vertex")
            demand(self.take("u8", "twin: number") > 0, "a twin that is zero")
        if twins:
            self.take("u16", "twins")
        self.zeros(align(size) - size)
        expected = checksum(seed(self.identity, 3, number, channel), self.data[begin:begin + size])
        demand(self.take("u64", "checksum") == expected, "a wrong checksum of a blob")


def raw_topology(data, counts):
    """Tets, places, shared flags."""
    tet_count, vert_count = counts
    kind, flags, verts, tets, _ = struct.unpack("<BBH3s3s", data[:10])
    demand(kind == 0 and flags & ~9 == 0 and verts == vert_count and int.from_bytes(tets, "little") == tet_count, "a raw head that can't be")
    form = f"<{4 * tet_count}H{3 * vert_count}{'q' if flags & 8 else 'i'}{vert_count}B{tet_count if flags & 1 else 0}i"
    numbers = struct.unpack(form, data[10:])
    places = numbers[4 * tet_count:][:3 * vert_count]
    return numbers[:4 * tet_count], [places[i:i + 3] for i in range(0, len(places), 3)], numbers[4 * tet_count + 3 * vert_count:][:vert_count]


def listing(data):
    text = []
    for place, hexes, what in Reader(data).lines:
        if not place and not what.startswith("    "):
            text.append("")
        text.append(f"    {place:4}  {hexes:47}  {what}".rstrip() if place or what.startswith(" ") else f"    {what}")
    return "\n".join(text).strip("\n") + "\n"


def golden():
    with open(GOLDEN, "rb") as f:
        return f.read()


class Format(unittest.TestCase):
    def test_checksum(self):
        data = bytes(range(100))
        self.assertEqual([checksum(0, b""), checksum(0, data[:1]), checksum(1, data), seed(1, 3, 2, 3)],
                         [0x26ED6B45D1FD96CA, 0x18730A396A0C3D2A, 0x630A4568CD6FB9FF, 0x28E4D25B3A4BBA4B])
        with open(FORMAT, encoding="utf-8") as f:
            text = f.read()
        for value in (checksum(0, b""), checksum(0, data[:1]), checksum(1, data), seed(1, 3, 2, 3), A, B, C, D):
            self.assertIn(f"{value:016x}", text)

    def test_golden_file_is_read(self):
        reader = Reader(golden())
        self.assertEqual((reader.patch_count, reader.segment_count, reader.outputs), (3, 1, {0: [0]}))

    def test_raw_blobs_are_read(self):
        decoded = Reader(golden()).decoded
        tets, places, shared = decoded[1, NONE]
        self.assertEqual((tets, places, shared), ((0, 1, 2, 3), [(0, 0, 0), (2, 0, 0), (0, 4, 0), (0, 0, 4)], (0, 1, 1, 1)))
        self.assertEqual([decoded[n, 0] for n in range(3)], [(0, 100, 0, 0), (0, 48, 0, 0), (100, 48, 0, 0)])

    def test_every_changed_byte_is_found(self):
        data = golden()
        for i in range(len(data)):
            changed = bytearray(data)
            changed[i] ^= 0x10
            with self.assertRaises(Exception, msg=f"byte {i}") as caught:
                Reader(bytes(changed))
            self.assertIsInstance(caught.exception, (Damaged, struct.error, OverflowError, IndexError), f"byte {i}")

    def test_worked_example_is_current(self):
        with open(FORMAT, encoding="utf-8") as f:
            example = re.search(r"## Worked example\n.*?\n\n(    Head\n.*)\Z", f.read(), re.S)
        self.assertTrue(example)
        self.assertEqual(example[1], listing(golden()), "write it again: tests/store_format_test.py --listing")


if __name__ == "__main__":
    if sys.argv[1:] == ["--listing"]:
        sys.stdout.write(listing(golden()))
    else:
        unittest.main()
