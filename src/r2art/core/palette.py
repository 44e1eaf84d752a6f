"""Colours that stay apart for colour-blind eyes too, shared by drawings and 3D scenes."""

Color = tuple[int, int, int]

WHITE: Color = (255, 255, 255)
GREY: Color = (165, 171, 181)
AMBER: Color = (255, 196, 87)
RED: Color = (255, 110, 100)
CARD: Color = (24, 26, 31)
RIM: Color = (14, 16, 20)

# Okabe and Ito (2008), https://jfly.uni-koeln.de/color, without black; lifted a little where
# they would sink into a dark photo.
PART_COLORS: tuple[Color, ...] = (
    (86, 180, 233),  # sky blue
    (240, 165, 20),  # orange
    (214, 122, 172),  # reddish purple
    (240, 228, 66),  # yellow
    (20, 175, 125),  # bluish green
    (232, 110, 40),  # vermilion
    (60, 130, 220),  # blue
)

# The root frame's right, up and front, in the customary red, green and blue.
AXIS_COLORS: tuple[Color, Color, Color] = ((238, 64, 64), (70, 190, 70), (72, 120, 255))


def part_color(index: int) -> Color:
    """Colour of the part with this index; they repeat after seven."""
    return PART_COLORS[index % len(PART_COLORS)]
