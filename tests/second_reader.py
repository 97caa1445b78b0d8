#!/usr/bin/env python3
"""A second reader of scene packs, from the words of format/SPEC.md alone: shares no code with the first.

usage: second_reader.py PACK    prints one JSON object: header, and each section with the XXH3 of its decoded bytes
Exit code 3 and one line on stderr where the pack is not valid. Needs libzstd.so.1 and libxxhash.so.0.
"""
import ctypes
import json
import struct
import sys

zstd = ctypes.CDLL("libzstd.so.1")
zstd.ZSTD_decompress.restype = zstd.ZSTD_findFrameCompressedSize.restype = ctypes.c_size_t
zstd.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
zstd.ZSTD_decompress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_size_t]
zstd.ZSTD_findFrameCompressedSize.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
zstd.ZSTD_getFrameContentSize.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
xxhash = ctypes.CDLL("libxxhash.so.0")
xxhash.XXH3_64bits.restype = ctypes.c_uint64
xxhash.XXH3_64bits.argtypes = [ctypes.c_void_p, ctypes.c_size_t]

STRIDES = {"FACT": 112, "prov": 1, "STRS": 1, "p256": 1, "p512": 1, "prox": 1, "TREE": 16, "INST": 112, "PART": 72,
           "TOPN": 64, "FACE": 136, "drop": 16, "PTCH": 100, "CTRL": 4, "NODE": 64, "LEAF": 32, "TPNT": 8, "TPCE": 4,
           "CELL": 4, "CENT": 8, "SDFW": 4}


class Invalid(Exception):
    pass


def need(condition, what):
    if not condition:
        raise Invalid(what)


def xxh3(data):
    return xxhash.XXH3_64bits(data, len(data))


def read_header(data):
    need(len(data) >= 128, "shorter than a header")
    need(data[:12] == bytes.fromhex("AB5452415920 31BB0D0A1A0A"), "identifier")
    names = ("major", "minor", "file_size", "decoded_size", "required", "optional", "content_id")
    header = dict(zip(names, struct.unpack_from("<HHQQQQQ", data, 12)))
    state, count, table_offset, table_xxh3 = struct.unpack_from("<4sIQQ", data, 56)
    need(struct.unpack_from("<Q", data, 120)[0] == xxh3(data[:120]), "header checksum")
    need(header["major"] == 1, "major version")
    need(state == b"clsd", "not closed")
    need(header["required"] & ~1 == 0, "required feature")
    need(header["file_size"] == len(data), "file size")
    need(data[80:120] == bytes(40), "reserved bytes")
    need(1 <= count <= 256 and table_offset == 128 and 128 + 80 * count <= len(data), "section table")
    need(xxh3(data[128:128 + 80 * count]) == table_xxh3, "section table checksum")
    return header, count


def unfilter(frame, stride, delta, planes):
    n = len(frame) // stride
    columns = []
    for c in range(stride // 4):
        stored = frame[4 * n * c:4 * n * (c + 1)]
        if planes >> c & 1:
            stored = bytes(b for word in zip(*(stored[n * k:n * (k + 1)] for k in range(4))) for b in word)
        words = list(struct.unpack(f"<{n}I", stored))
        if delta >> c & 1:
            before = 0
            for i in range(n):
                words[i] = before = (words[i] + before) & 0xFFFFFFFF
        columns.append(words)
    return struct.pack(f"<{n * len(columns)}I", *(word for record in zip(*columns) for word in record))


def unzigzag(word):
    return word >> 1 ^ -(word & 1)


def signed(word):
    return (word + (1 << 31)) % (1 << 32) - (1 << 31)


def restore_nets(content, contents):
    words = list(struct.unpack(f"<{len(content) // 4}I", content))
    end, patches = 0, contents.get("PTCH") or b""
    for at in range(0, len(patches), 100):
        shape, first = struct.unpack_from("<II", patches, at + 32)
        nu, nv, rational = (shape >> 8 & 255) + 1, (shape >> 16 & 255) + 1, shape >> 24 & 1
        width = 3 + rational
        if shape & 255 != 5 or first < end or first + nu * nv * width > len(words):
            continue
        end = first + nu * nv * width
        for c in range(width):
            g = [[0] * nv for _ in range(nu)]

            def on(i, j):  # along u
                return g[i - 1][j] if i < 2 else 2 * g[i - 1][j] - g[i - 2][j]
            for i in range(nu):
                for j in range(nv):
                    if i == 0:
                        guess = 0 if j == 0 else g[0][0] if j == 1 else 2 * g[0][j - 1] - g[0][j - 2]
                    else:
                        guess = on(i, j) if j == 0 else on(i, j) + g[i][j - 1] - on(i, j - 1)
                    n = first + (i * nv + j) * width + c
                    g[i][j] = guess + unzigzag(words[n]) & 0xFFFFFFFF
                    words[n] = g[i][j] if c == 3 else from_grid(g[i][j], 24 if rational else 22)
    return struct.pack(f"<{len(words)}I", *words)


def from_grid(k, bits):
    return struct.unpack("<I", struct.pack("<f", signed(k) / (1 << bits)))[0]


def restore_points(content, contents):
    words, last = list(struct.unpack(f"<{len(content) // 4}I", content)), [0, 0]
    for n, word in enumerate(words):
        last[n % 2] = last[n % 2] + unzigzag(word) & 0xFFFFFFFF
        words[n] = from_grid(last[n % 2], 22)
    return struct.pack(f"<{len(words)}I", *words)


def restore_pieces(content, contents):
    words, faces, before = list(struct.unpack(f"<{len(content) // 4}I", content)), contents["FACE"], 0
    begins = {0} | {struct.unpack_from("<I", faces, at + 48)[0] for at in range(0, len(faces), 136)}
    for n, word in enumerate(words):
        point = 0 if n in begins else (before >> 4) + (3 if before & 1 else 1)
        point = point + unzigzag(word >> 3) & 0xFFFFFFF
        before = point << 4 | ((word >> 1) + (before >> 2) & 3) << 2 | (word ^ before) & 1
        words[n] = before
    return struct.pack(f"<{len(words)}I", *words)


def restore_texels(out, first, width, rows, shared):
    for n in range(width * rows):
        x, y = n % width, n // width
        left = out[first + n - 1] if x else 0
        upper = out[first + n - width] if y else 0
        guess = left + upper
        if x and y:
            guess = max(0, min(255, guess - out[first + n - width - 1]))
        known = shared(x, y)
        out[first + n] = out[first + n] + (guess if known is None else known) & 255


def restore_tiles(out, first, width, height, shift):
    tiles_u, tiles_v = (max(width, 2) - 2 >> shift) + 1, (max(height, 2) - 2 >> shift) + 1
    side, kept = (1 << shift) + 1, 0
    below = [None] * tiles_u
    for tile in range(tiles_u * tiles_v):
        tx, ty, at = tile % tiles_u, tile // tiles_u, first + 2 * tile
        entry, = struct.unpack_from("<H", out, at)
        if entry < 2:
            texel = lambda x, y, value=255 * entry: value
        else:
            begin = first + 2 * tiles_u * tiles_v + kept * side * side
            need(begin + side * side <= len(out), "a tile outside SDFW")
            struct.pack_into("<H", out, at, entry + kept & 0xFFFF)
            restore_texels(out, begin, side, side, lambda x, y: left(side - 1, y) if x == 0 and tx else
                           below[tx](x, side - 1) if y == 0 and ty else None)
            texel = lambda x, y, begin=begin: out[begin + y * side + x]
            kept += 1
        left = below[tx] = texel
    return 2 * tiles_u * tiles_v + kept * side * side


def restore_textures(content, contents):
    out, end, faces = bytearray(content), 0, contents["FACE"]
    for at in range(0, len(faces), 136):
        flags, = struct.unpack_from("<I", faces, at + 12)
        size, first_word = struct.unpack_from("<II", faces, at + 56)
        width, height, shift, first = size & 0xFFFF, size >> 16, flags >> 8 & 7, 4 * first_word
        if width == 0 or height == 0 or first < end or first > len(out):
            continue
        if shift:
            count = restore_tiles(out, first, width, height, shift)
        else:
            count = max(width, 2) * height
            need(first + count <= len(out), "a texture outside SDFW")
            restore_texels(out, first, max(width, 2), height, lambda x, y: None)
        end = first + (count + 3) // 4 * 4
    return bytes(out)


def restore_trees(content, contents):
    nodes = [list(node) for node in struct.iter_unpack("<3I4B12B12B4I2I", content)]
    path, root, leaves = [], 0, 0  # path: [node, slot] of nodes whose slots are not all passed
    for n, node in enumerate(nodes):
        origin, exponents = [0.0] * 3, [0, 0, 0, 0]
        if not path:
            root, leaves = n, 0
        else:
            (p, slot), parent = path[-1], nodes[path[-1][0]]
            for c in range(3):
                lo, hi = parent[7 + 4 * c + slot], parent[19 + 4 * c + slot]
                base = struct.unpack("<f", struct.pack("<I", parent[c]))[0]
                origin[c] = base + 2.0 ** (parent[3 + c] - 127) * lo
                exponents[c] = parent[3 + c] + (hi - lo & 255).bit_length() - 8
            parent[31 + slot] = n - root
            path[-1][1] += 1
        for c in range(3):
            expected = struct.unpack("<I", struct.pack("<f", origin[c]))[0]
            node[c] = expected + unzigzag(node[c]) & 0xFFFFFFFF
            for k in range(4):
                lo, hi = 7 + 4 * c + k, 19 + 4 * c + k
                if node[31 + k] == 0:
                    node[lo] ^= 255
                else:
                    node[hi] = node[hi] + node[lo] & 255
        node[3:7] = [a + b & 255 for a, b in zip(node[3:7], exponents)]
        path.append([n, 0])
        while path and (path[-1][1] == 4 or nodes[path[-1][0]][31 + path[-1][1]] != 2):
            if path[-1][1] == 4:
                path.pop()
                continue
            at, slot = nodes[path[-1][0]], path[-1][1]
            if at[31 + slot] == 1:
                at[31 + slot], leaves = 0x80000000 | leaves, leaves + 1
            else:
                at[31 + slot] = 0xFFFFFFFF
            path[-1][1] += 1
    return b"".join(struct.pack("<3I4B12B12B4I2I", *node) for node in nodes)


RESTORE = {"CTRL": restore_nets, "TPNT": restore_points, "TPCE": restore_pieces, "NODE": restore_trees,
           "SDFW": restore_textures}


def decompress(stored, entry):
    decoded = []
    frame_size = (1 << 20) // entry["stride"] * entry["stride"]
    for begin in range(0, entry["decoded_size"], frame_size):
        size = min(frame_size, entry["decoded_size"] - begin)
        need(zstd.ZSTD_getFrameContentSize(stored, len(stored)) == size, "content size of a frame")
        stored_size = zstd.ZSTD_findFrameCompressedSize(stored, len(stored))
        need(stored_size <= len(stored), "frame")
        out = ctypes.create_string_buffer(size)
        need(zstd.ZSTD_decompress(out, size, stored[:stored_size], stored_size) == size, "frame")
        stored = stored[stored_size:]
        frame = out.raw
        decoded.append(unfilter(frame, entry["stride"], entry["delta"], entry["planes"]) if entry["filter"] else frame)
    need(not stored, "bytes after the last frame")
    return b"".join(decoded)


def read_section(data, at, end, contents):
    entry = dict(zip(("codec", "filter", "offset", "stored_size", "decoded_size", "count", "stride", "reserved", "delta",
                      "planes", "stored_xxh3", "decoded_xxh3"), struct.unpack_from("<HHQQQQIIQQQQ", data, at + 4)))
    entry["id"] = data[at:at + 4].decode("ascii")
    offset, size = entry["offset"], entry["stored_size"]
    alignment = 64 if entry["codec"] == 0 else 8
    need(offset == (end + alignment - 1) // alignment * alignment and offset + size <= len(data), entry["id"] + ": place")
    need(not any(data[end:offset]), entry["id"] + ": padding")
    stored = data[offset:offset + size]
    need(xxh3(stored) == entry["stored_xxh3"], entry["id"] + ": stored checksum")
    if entry["id"] not in STRIDES:
        need(entry["id"][0].islower(), entry["id"] + ": unknown and critical")
        return entry, None
    need(entry["stride"] == STRIDES[entry["id"]], entry["id"] + ": stride")
    need(entry["decoded_size"] == entry["count"] * entry["stride"] and entry["codec"] <= 1, entry["id"] + ": form")
    content = decompress(stored, entry) if entry["codec"] == 1 else stored
    if entry["filter"] == 2:
        need(entry["id"] in RESTORE and entry["codec"] == 1, entry["id"] + ": filter")
        content = RESTORE[entry["id"]](content, contents)
    need(len(content) == entry["decoded_size"], entry["id"] + ": decoded size")
    need(xxh3(content) == entry["decoded_xxh3"], entry["id"] + ": decoded checksum")
    return entry, content


def strings_of(content):
    return [s.decode("utf-8") for s in content.split(b"\0")[:-1]]


def read_pack(data):
    header, count = read_header(data)
    end, summary, sections, contents = 128 + 80 * count, b"", [], {}
    for i in range(count):
        entry, content = read_section(data, 128 + 80 * i, end, contents)
        end = entry["offset"] + entry["stored_size"]
        summary += entry["id"].encode() + struct.pack("<QQ", entry["decoded_size"], entry["decoded_xxh3"])
        sections.append({key: entry[key] for key in ("id", "count", "stored_size", "decoded_size", "decoded_xxh3")})
        contents[entry["id"]] = content
    need(end == len(data), "end of the last section")
    need(xxh3(summary) == header["content_id"], "content id")
    need(sum(s["decoded_size"] for s in sections) == header["decoded_size"], "total decoded size")
    return header, sections, contents


def describe(header, sections, contents):
    facts = struct.unpack_from("<10d", contents["FACT"])
    strings = strings_of(contents.get("STRS", b"\0"))
    faces = contents.get("FACE") or b""
    names = [strings[struct.unpack_from("<I", faces, at + 4)[0]] for at in range(0, len(faces), 136)]
    kinds = [struct.unpack_from("<I", faces, at + 92)[0] for at in range(0, len(faces), 136)]
    return {"version": f"{header['major']}.{header['minor']}", "content_id": f"{header['content_id']:016x}",
            "compact": bool(header["required"] & 1), "provenance": strings_of(contents.get("prov", b"")),
            "bounds_mm": [facts[0:3], facts[3:6]], "faces_by_kind": [kinds.count(k) for k in range(6)],
            "face_names": sorted(set(names)),
            "sections": [{**s, "decoded_xxh3": f"{s['decoded_xxh3']:016x}"} for s in sections]}


if __name__ == "__main__":
    try:
        with open(sys.argv[1], "rb") as file:
            print(json.dumps(describe(*read_pack(file.read())), ensure_ascii=False))
    except (Invalid, struct.error, OverflowError, UnicodeDecodeError) as error:
        print(f"{sys.argv[1]}: not a valid pack: {error}", file=sys.stderr)
        sys.exit(3)
