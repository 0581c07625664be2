"""A plot of growth as SVG: what each of some programs reaches as axes are added."""
import html

WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 460, 300, 50, 40, 50
COLOURS = ("#c1272d", "#d98880", "#0000a7", "#008176", "#b3902b")


class Panel:
    def __init__(self, title, number, places, highest):
        self.title, self.origin, self.places, self.highest = title, number * WIDTH, places, highest

    def x(self, index):
        return self.origin + LEFT + (WIDTH - LEFT - 20) * (index + 0.5) / len(self.places)

    def y(self, value):
        return HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * value / self.highest

    def frame(self):
        step = next(step for step in (1, 2, 5, 10, 20, 50, 100, 200, 500) if self.highest / step <= 8)
        left, right = self.origin + LEFT, self.origin + WIDTH - 20
        yield text((left + right) / 2, TOP - 15, self.title, "middle")
        yield text((left + right) / 2, HEIGHT - 12, "axes that index at once", "middle")
        for value in range(0, int(self.highest) + 1, step):
            yield line(left, self.y(value), right, self.y(value), "#ddd")
            yield text(left - 6, self.y(value) + 4, str(value), "end")
        for index, place in enumerate(self.places):
            yield text(self.x(index), HEIGHT - BOTTOM + 16, str(place), "middle")

    def curve(self, values, colour):
        """(minimum, median, maximum) of each place."""
        points = [(self.x(index), *map(self.y, value)) for index, value in enumerate(values)]
        yield (f'<polyline fill="none" stroke="{colour}" stroke-width="2" points="'
               + " ".join(f"{x:.1f},{median:.1f}" for x, _, median, _ in points) + '"/>')
        for x, low, median, high in points:
            yield line(x, low, x, high, colour)
            yield f'<circle cx="{x:.1f}" cy="{median:.1f}" r="3" fill="{colour}"/>'


def text(x, y, words, anchor):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{html.escape(words)}</text>'


def line(x1, y1, x2, y2, colour):
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{colour}"/>'


def write(path, unit, panels):
    """`panels`: title -> {program -> {place -> (minimum, median, maximum)}}."""
    parts = []
    for number, (title, programs) in enumerate(panels.items()):
        places = sorted({place for values in programs.values() for place in values})
        highest = max(value[-1] for values in programs.values() for value in values.values()) * 1.05
        panel = Panel(f"{title}: {unit}", number, places, max(highest, 1))
        parts += panel.frame()
        for colour, values in zip(COLOURS, programs.values()):
            parts += panel.curve([values[place] for place in places], colour)
    for number, (colour, name) in enumerate(zip(COLOURS, next(iter(panels.values())))):
        parts += [line(LEFT + number * 190, HEIGHT + 8, LEFT + 20 + number * 190, HEIGHT + 8, colour),
                  text(LEFT + 26 + number * 190, HEIGHT + 12, name, "start")]
    size = f'width="{max(WIDTH * len(panels), LEFT + len(COLOURS) * 190)}" height="{HEIGHT + 24}"'
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="12">'
                    f'<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(parts) + "\n</svg>\n", encoding="utf-8")
