"""Whether a drawing can be read: texts stay on the sheet and off each other."""

from __future__ import annotations

from sitscad.files.drawing.sheet import Label, text_width


def assert_legible(sheet):
    """Texts stay on the sheet and off each other."""
    width, height = sheet.size
    boxes = []
    for item in sheet.items:
        if isinstance(item, Label):
            long = text_width(item.text, item.size)
            back = {"start": 0.0, "middle": long / 2, "end": long}[item.anchor]
            x, y = item.at
            box = (x - back, y, x - back + long, y + 0.7 * item.size)
            if item.angle:
                box = (x - 0.7 * item.size, y - back, x, y - back + long)
            boxes.append((box, item.text))
    for (x0, y0, x1, y1), text in boxes:
        assert x0 > 5 and x1 < width - 5 and y0 > 5 and y1 < height - 5, text
    for i, (a, each) in enumerate(boxes):
        for b, other in boxes[i + 1 :]:
            apart = a[2] <= b[0] + 0.05 or b[2] <= a[0] + 0.05 or a[3] <= b[1] + 0.05 or b[3] <= a[1] + 0.05
            assert apart, (each, other)
