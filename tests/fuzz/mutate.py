"""Mutations of decks and of the files they include: what becomes of a seed is a function of a random state alone.

A deck is a dict from file name to bytes; the first file is the deck itself.
"""

import re

NUMBER = re.compile(rb"(?<![A-Za-z0-9_.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?")
KEYWORD = re.compile(rb"^\*[A-Za-z][A-Za-z ]*", re.M)
# sizes of meshes between these and the largest integers would be allowed, and keep a run busy for long: left out
EXTREMES = (
    b"0 -0. -1 1 2 3 7 0.5 1.0000001 -7 1e-300 1E-320 1e300 -1e308 1e309 1e999999 1d400 nan NaN inf -Infinity 1e30 "
    b"2147483646 2147483647 2147483648 -2147483648 -2147483649 4294967296 9223372036854775807 9223372036854775808 "
    b"99999999999999999999 1,,2 1. 1.e 1.e+ +-1 0x10 1_8 .5. . - + 1/3 2*3 1;2 1e-5 1e5 0.9999999 180 90 360"
).split()
BYTES = (
    b"\0 \1 \7 \x1b \x7f \x80 \xff \xc3\xa9 \xe2\x82\xac \xf0\x9f\x92\xa5 \xef\xbb\xbf \r \n \t \v \f < > <> <H> "
    b"* ** , ,, = \" ' / \\ ! ( ) | & ; : % # @ ~ `"
).split(b" ")
INCLUDES = b'. .. / /dev/null /proc/self/mem /nowhere/file deck.inp ./deck.inp mesh/../deck.inp <A> <H> ""'.split(b" ")
LOOPS = (
    b"*PARAMETER\nA = <A>\n",
    b"*PARAMETER\nA = <B>\nB = <A>\n",
    b"*PARAMETER\nAA = 1\nAB = <AA><AA>\nAC = <AB><AB>\nAD = <AC><AC>\nAE = <AD><AD>\nAF = <AE><AE>\nAG = <AF><AF>\n",
    b"*PARAMETER\nA = 1\n<A> = 2\n<<A>> = 3\nB = <A\nC = A>\n",
    b"*PARAMETER\n*INCLUDE, INPUT=deck.inp\n",
)


def lines_of(text):
    return text.split(b"\n")


def pick(random, text):
    """A place in the text: of a number, a word between commas, or any."""
    words = [found.span() for found in re.finditer(rb"[^,\n=]+", text)]
    return random.choice(words) if words else (0, len(text))


def swap_words(random, text, _):
    (a, b), (c, d) = sorted((pick(random, text), pick(random, text)))
    return text if b > c else text[:a] + text[c:d] + text[b:c] + text[a:b] + text[d:]


def drop_word(random, text, _):
    a, b = pick(random, text)
    return text[:a] + text[b:]


def double_word(random, text, _):
    a, b = pick(random, text)
    return text[:b] + random.choice((b"", b",", b"=")) + text[a:b] + text[b:]


def word_of_another(random, text, others):
    a, b = pick(random, text)
    other = random.choice(others)
    c, d = pick(random, other)
    return text[:a] + other[c:d] + text[b:]


def extreme_number(random, text, _):
    numbers = [found.span() for found in NUMBER.finditer(text)]
    if not numbers:
        return text
    a, b = random.choice(numbers)
    return text[:a] + random.choice(EXTREMES) + text[b:]


def other_number(random, text, _):
    numbers = [found.span() for found in NUMBER.finditer(text)]
    if not numbers:
        return text
    (a, b), (c, d) = random.choice(numbers), random.choice(numbers)
    return text[:a] + text[c:d] + text[b:]


def scaled_number(random, text, _):
    """Another number of the same kind: most decks stay good ones."""
    numbers = [found.span() for found in NUMBER.finditer(text)]
    if not numbers:
        return text
    a, b = random.choice(numbers)
    factor = random.choice((-1.0, 0.01, 0.5, 0.9, 1.000001, 1.1, 2.0, 100.0))
    number = float(text[a:b].lower().replace(b"d", b"e")) * factor
    whole = text[a:b].lstrip(b"+-").isdigit() and abs(number) < 1e9
    return text[:a] + (b"%d" % round(number) if whole else b"%.9G" % number) + text[b:]


def change_digit(random, text, _):
    digits = [found.start() for found in re.finditer(rb"\d", text)]
    if not digits:
        return text
    a = random.choice(digits)
    return text[:a] + random.choice((b"", b"0", b"1", b"9", b".", b"-", b"e", b" ", b",")) + text[a + 1 :]


def some_bytes(random, text, _):
    a = random.randrange(len(text) + 1)
    return text[:a] + random.choice(BYTES) * random.choice((1, 1, 1, 2, 50)) + text[a + random.choice((0, 1)) :]


def binary_block(random, text, _):
    a = random.randrange(len(text) + 1)
    return text[:a] + random.randbytes(random.randrange(1, 300)) + text[a:]


def drop_line(random, text, _):
    lines = lines_of(text)
    del lines[random.randrange(len(lines))]
    return b"\n".join(lines)


def drop_lines(random, text, _):
    lines = lines_of(text)
    a = random.randrange(len(lines))
    del lines[a : a + random.randrange(1, 1 + max(1, len(lines) // 4))]
    return b"\n".join(lines)


def double_line(random, text, _):
    lines = lines_of(text)
    a = random.randrange(len(lines))
    lines[a:a] = [lines[a]] * random.choice((1, 1, 1, 2, 30))
    return b"\n".join(lines)


def swap_lines(random, text, _):
    lines = lines_of(text)
    a, b = random.randrange(len(lines)), random.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def join_lines(random, text, _):
    ends = [found.start() for found in re.finditer(b"\n", text)]
    if not ends:
        return text
    a = random.choice(ends)
    return text[:a] + random.choice((b"", b",", b" ")) + text[a + 1 :]


def break_line(random, text, _):
    a = random.randrange(len(text) + 1)
    return text[:a] + random.choice((b"\n", b",\n", b"\n*", b"\n**")) + text[a:]


def long_line(random, text, _):
    a = random.randrange(len(text) + 1)
    return (
        text[:a]
        + random.choice((b"1,", b"x", b" ", b",", b"<H>", b"\\")) * random.choice((700, 2001, 50000))
        + text[a:]
    )


def truncate(random, text, _):
    return text[: random.randrange(len(text) + 1)]


def block_of_another(random, text, others):
    """A keyword with its data lines from another deck, at the beginning of a line."""
    other = random.choice(others)
    starts = [found.start() for found in KEYWORD.finditer(other)]
    if not starts:
        return text
    n = random.randrange(len(starts))
    block = other[starts[n] : (starts + [len(other)])[n + 1]][:2000]
    places = [0] + [found.end() for found in re.finditer(b"\n", text)]
    a = random.choice(places)
    return text[:a] + block + b"\n" + text[a:]


def keyword_of_another(random, text, others):
    starts = [found.span() for found in KEYWORD.finditer(text)]
    words = KEYWORD.findall(random.choice(others))
    if not starts or not words:
        return text
    a, b = random.choice(starts)
    return text[:a] + random.choice(words) + text[b:]


def include(random, text, _):
    places = [0] + [found.end() for found in re.finditer(b"\n", text)]
    a = random.choice(places)
    return text[:a] + b"*INCLUDE, INPUT=" + random.choice(INCLUDES) + b"\n" + text[a:]


def parameter_loop(random, text, _):
    places = [0] + [found.end() for found in re.finditer(b"\n", text)]
    a = random.choice(places)
    text = text[:a] + random.choice(LOOPS) + text[a:]
    if random.random() < 0.5:
        text = extreme_word(random, text, random.choice((b"<A>", b"<AG>", b"<A", b"<>")))
    return text


def extreme_word(random, text, word):
    a, b = pick(random, text)
    return text[:a] + word + text[b:]


def line_ends(random, text, _):
    return text.replace(b"\n", random.choice((b"\r\n", b"\r", b"\n\n", b" \n")))


def change_case(random, text, _):
    return random.choice((text.upper(), text.lower(), text.swapcase()))


MUTATIONS = [
    *[scaled_number] * 12,
    *[extreme_number] * 4,
    *[swap_words, drop_word, double_word, word_of_another, other_number, change_digit] * 2,
    *[some_bytes, drop_line, swap_lines, block_of_another, keyword_of_another] * 2,
    *[drop_lines, double_line, join_lines, break_line, long_line, truncate, binary_block, include, parameter_loop],
    *[line_ends, change_case],
]


def mutate(random, files, others):
    """A mutated copy of a deck; `others` are texts to take words, keywords and blocks from."""
    files = dict(files)
    names = list(files)
    for _ in range(random.choice((1, 1, 1, 1, 2, 2, 3))):
        name = names[0] if len(names) == 1 or random.random() < 0.7 else random.choice(names[1:])
        files[name] = random.choice(MUTATIONS)(random, files[name], others)
    return files
