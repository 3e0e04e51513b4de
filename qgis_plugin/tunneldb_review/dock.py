"""Review dock: its widgets, keys and actions; the logic of a review is in :mod:`.session`."""

from __future__ import annotations

from typing import Any, Callable, Dict, Iterable, List

from qgis.gui import QgsMapCanvas
from qgis.PyQt.QtCore import Qt, QTimer, pyqtSignal
from qgis.PyQt.QtGui import QKeySequence
from qgis.PyQt.QtWidgets import QCheckBox, QDockWidget, QHBoxLayout, QLabel, QProgressBar, QShortcut, QVBoxLayout, QWidget

from .canvas import Followers
from .cutout_view import CutoutView
from .cutouts import CutoutMaker, ImageSource, Picture
from .database import DatabaseError
from .facts_panel import FactsPanel, keys_of
from .filter_bar import FilterBar
from .images import KINDS, OPTIONAL, window
from .own_keys import OwnKeys
from .session import Session
from .worklist import CONFIRMED, OPEN, REJECTED, Finding

AHEAD = 2
"""Number of findings whose pictures are drawn in advance."""

NO_IMAGE = "No image: open the project of the survey, or name a folder of images in Connect."

LINGER = 300
"""Delay before the map follows to a finding, ms: drawing takes longer than a verdict."""

_ZOOM, _ZOOMS = 1.5, (0.1, 8.0)


class ReviewDock(QDockWidget):
    """Steps through the findings of a survey by keys.

    Parameters
    ----------
    canvases : callable
        Returns the map canvases that follow.
    parent : QWidget, optional
    """

    said = pyqtSignal(str, bool)
    """Message for the user, and whether it is an error."""

    survey_changed = pyqtSignal(str)
    reload_wanted = pyqtSignal()

    def __init__(self, canvases: Callable[[], Iterable[QgsMapCanvas]], parent: QWidget | None = None) -> None:
        super().__init__("Leak review", parent)
        self.setObjectName("tunneldb_review_dock")
        self.canvases = canvases
        self.session: Session | None = None
        self.source, self.maker, self.followers = ImageSource(), CutoutMaker(self), Followers()
        self.own_keys = OwnKeys(self.take_keys, self)
        self.lingering, self.changed = QTimer(self), False
        self.lingering.setSingleShot(True)
        self.lingering.setInterval(LINGER)
        self.lingering.timeout.connect(self._move_map)
        self.zoom = 1.0
        self.filters, self.panel = FilterBar(), FactsPanel()
        self.views = {kind: CutoutView(title) for kind, title in KINDS.items()}
        self.progress, self.told, self.message = QProgressBar(), QLabel(), QLabel()
        self.progress.setTextVisible(False)
        self.progress.setMaximumHeight(8)
        self.told.setObjectName("progress")
        self.told.setWordWrap(True)
        self.coverage = QLabel()
        self.coverage.setObjectName("coverage")
        self.coverage.setTextFormat(Qt.TextFormat.PlainText)
        self.coverage.setWordWrap(True)
        self.message.setObjectName("message")
        self.message.setWordWrap(True)
        self.go_on = QCheckBox("next finding after a verdict")
        self.go_on.setChecked(True)
        self.follow = QCheckBox("map follows")
        self.follow.setChecked(True)
        self._arrange()
        self._connect()
        self._refresh()

    def begin(self, session: Session, survey: str) -> None:
        """Review in a database that is connected; an empty survey is the first of it."""
        self.session = session
        self.filters.offer(session.surveys, session.kinds, survey)
        self.panel.offer(session.kinds)
        if not session.surveys:
            self._say("The database has no survey of a tunnel.", wrong=True)
            return
        self.read()

    def end(self) -> None:
        """Forget the database."""
        self.session = None
        self.lingering.stop()
        self.maker.stop()
        self.followers.clear()
        self._refresh()

    def read(self) -> None:
        """Read the chosen survey from the database, and begin with it."""
        survey = str(self.filters.survey.currentData())

        def load(session: Session) -> None:
            session.load(survey, self.filters.filter, str(self.filters.order.currentData()))

        self._do(load)
        self.survey_changed.emit(survey)

    def confirm(self) -> None:
        """Confirm the finding, and go on."""
        self._judge(CONFIRMED)

    def reject(self) -> None:
        """Reject the finding, and go on."""
        self._judge(REJECTED)

    def reopen(self) -> None:
        """Remove the verdict, and stay."""
        self._do(lambda session: session.write(review=OPEN), repaint=True)

    def set_kind(self, code: str) -> None:
        """Set the kind of the finding."""
        self._do(lambda session: session.write(kind=code), repaint=True)

    def set_remark(self, text: str) -> None:
        """Write the remark, and return the keys to the dock; a remark that cannot be written stays in the field."""
        if self._do(lambda session: session.write(remark=text.strip() or None)):
            self.take_keys()

    def undo(self) -> None:
        """Undo the last step, and go to its finding.

        A remark that was typed, and not entered, is written if that is elsewhere, else it stays in its line.
        """
        told: List[str] = []
        typed = self._remark_begun()
        begun = self.panel.remark.text() if typed and self.session is not None and self.session.undoes_shown else None
        if self._do(lambda session: told.append(session.undo(**typed)), repaint=True, remark=False):
            self._keep_remark(begun)
            self._say(told[0])

    def next(self) -> None:
        """Go to the next finding."""
        self._step(lambda session: session.next(), "That was the last finding of this selection.")

    def previous(self) -> None:
        """Go to the previous finding."""
        self._step(lambda session: session.previous(), "There is no previous finding.")

    def take_keys(self) -> None:
        """Give the keyboard focus to the dock."""
        self.widget().setFocus()

    def read_again(self) -> bool:
        """Read the findings again, and draw the pictures anew, of images that were read again; whether findings were read."""
        self.source.forget()
        self.maker.clear()
        if self.session is None or not self.session.survey:
            return False
        return self._do(lambda session: session.again(self.filters.filter, str(self.filters.order.currentData())))

    def settled(self) -> bool:
        """Return True if all pictures of the finding exist."""
        return all(view.picture is None or view.missing or view.image is not None for view in self.views.values())

    def _judge(self, review: str) -> None:
        def judge(session: Session) -> None:
            session.write(review=review, **self._remark_begun())
            self.panel.remark.setModified(False)
            if self.go_on.isChecked() and session.next():
                return
            if self.go_on.isChecked():
                self._say("That was the last finding of this selection.")
            session.look()

        self.message.clear()
        self._do(judge, repaint=True, keep=True, remark=False)

    def _step(self, step: Callable[[Session], bool], end: str) -> None:
        went: List[bool] = []
        if self._do(lambda session: went.append(step(session))) and not went[0]:
            self._say(end)

    def _do(self, act: Callable[[Session], Any], *, repaint: bool = False, keep: bool = False, remark: bool = True) -> bool:
        """Act on the session and show the result; report an error in one line.

        Parameters
        ----------
        act : callable
        repaint : bool
            Whether layers show something else afterwards.
        keep : bool
            Whether what was said last stays.
        remark : bool
            Whether a remark that was typed, and not entered, is written first.
        """
        if self.session is None:
            self._say("Connect to a database first.", wrong=True)
            return False
        if not keep:
            self.message.clear()
        typed = self._remark_begun()
        try:
            if typed and remark:
                self.session.write(**typed)
                self.panel.remark.setModified(False)
            act(self.session)
        except DatabaseError as error:
            self._say(str(error), wrong=True)
            begun = self.panel.remark.text() if self.panel.remark.isModified() else None
            self._refresh(move=False)
            self._keep_remark(begun)
            return False
        self.changed |= repaint
        self._refresh()
        return True

    def _remark_begun(self) -> Dict[str, Any]:
        """Return the remark that was typed but not entered, if there is one."""
        box = self.panel.remark
        return (
            {"remark": box.text().strip() or None}
            if box.isModified() and self.session is not None and self.session.facts
            else {}
        )

    def _keep_remark(self, begun: str | None) -> None:
        """Leave a remark that was typed, and not entered, in its line."""
        if begun is not None:
            self.panel.remark.setText(begun)
            self.panel.remark.setModified(True)

    def _say(self, text: str, *, wrong: bool = False) -> None:
        self.message.setStyleSheet("color: #b00020" if wrong else "")
        self.message.setText(text)
        self.said.emit(text, wrong)

    def _refresh(self, *, move: bool = True) -> None:
        """Show the finding that the session is at."""
        session = self.session
        facts = session.facts if session is not None else None
        current = session.work.current if session is not None else None
        self.panel.show_finding(facts, current.probability if current is not None else None)
        total = len(session.work.findings) if session is not None else 0
        self.progress.setMaximum(max(total, 1))
        self.progress.setValue(session.work.reviewed if session is not None else 0)
        self.told.setText(session.progress() if session is not None else "not connected")
        self.coverage.setText(session.coverage if session is not None else "")
        self.coverage.setVisible(bool(self.coverage.text()))
        self._show_pictures()
        if move and session is not None:
            self.lingering.start()

    def _move_map(self) -> None:
        """Move the map to the finding when its pictures are ready."""
        if not self.settled():
            self.lingering.start()
            return
        if self.changed:
            self.followers.repaint(self.canvases())
            self.changed = False
        facts = self.session.facts if self.session is not None else None
        if facts is not None and self.follow.isChecked():
            self.followers.go(self.canvases(), facts)

    def _show_pictures(self) -> None:
        session = self.session
        if session is None or session.facts is None or session.work.current is None:
            for view in self.views.values():
                view.show_finding(None, "", OPEN)
            return
        self._show_current(session, session.work.current)
        if self.settled():
            self._draw_ahead()

    def _show_current(self, session: Session, current: Finding) -> None:
        assert session.facts is not None
        wanted = []
        for kind, view in self.views.items():
            picture = self._picture(current, kind, view)
            layers = self.source.layers(session.survey, kind, picture.window[0], picture.window[1])
            view.show_finding(picture, session.facts["outline"] or "", session.facts["review"], "" if layers else NO_IMAGE)
            view.setVisible(bool(layers) or kind not in OPTIONAL)
            image = self.maker.get(picture)
            if image is not None:
                view.set_image(image)
            if layers:
                wanted.append(picture)
                self.maker.want(picture, layers)
        self.maker.drop_others(wanted)

    def _draw_ahead(self) -> None:
        """Draw the pictures of the next findings, when those of this one are there."""
        session = self.session
        for finding in session.work.ahead(AHEAD) if session is not None else ():
            for kind, view in self.views.items():
                picture = self._picture(finding, kind, view)
                layers = self.source.layers(session.survey, kind, picture.window[0], picture.window[1])
                if layers:
                    self.maker.want(picture, layers)

    def _picture(self, finding: Finding, kind: str, view: CutoutView) -> Picture:
        ratio = view.devicePixelRatioF()
        width, height = max(round(view.width() * ratio), 1), max(round(view.height() * ratio), 1)
        box = finding.chainage_from, finding.chainage_to, finding.arc_from, finding.arc_to
        return Picture(finding.id, kind, width, height, window(box, width / height, self.zoom))

    def _made(self, picture: Picture) -> None:
        view = self.views[picture.kind]
        image = self.maker.get(picture)
        if view.picture == picture and image is not None:
            view.set_image(image)
            if self.settled():
                self._draw_ahead()

    def _zoomed(self, factor: float) -> None:
        self.zoom = min(max(self.zoom * factor, _ZOOMS[0]), _ZOOMS[1])
        self._show_pictures()

    def _toggle_outlines(self) -> None:
        for view in self.views.values():
            view.outlined = not view.outlined
            view.update()

    def _ask(self) -> None:
        if self.session is not None and self.session.survey:
            self._do(lambda session: session.ask(self.filters.filter, str(self.filters.order.currentData())))

    def _key_kind(self, key: str) -> None:
        code = keys_of(self.session.kinds).get(key) if self.session is not None else None
        if code is not None:
            self.set_kind(code)

    def _edit_remark(self) -> None:
        self.panel.remark.setFocus()
        self.panel.remark.selectAll()

    def _arrange(self) -> None:
        body = QWidget()
        body.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        row = QHBoxLayout(body)
        row.setContentsMargins(6, 4, 6, 4)
        left, right = QWidget(), QWidget()
        left.setFixedWidth(290)
        right.setFixedWidth(330)
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.filters)
        column.addWidget(self.go_on)
        column.addWidget(self.follow)
        column.addStretch(1)
        column.addWidget(self.message)
        column.addWidget(self.coverage)
        column.addWidget(self.told)
        column.addWidget(self.progress)
        row.addWidget(left)
        for kind, view in self.views.items():
            row.addWidget(view, 1)
            view.setVisible(kind not in OPTIONAL)
        row.addWidget(right)
        beside = QVBoxLayout(right)
        beside.setContentsMargins(0, 0, 0, 0)
        beside.addWidget(self.panel)
        self.setWidget(body)

    def _connect(self) -> None:
        self.maker.made.connect(self._made)
        self.filters.asked.connect(self._ask)
        self.filters.survey_chosen.connect(self.read)
        self.panel.kind_chosen.connect(self.set_kind)
        self.panel.remarked.connect(self.set_remark)
        for view in self.views.values():
            view.resized.connect(self._show_pictures)
        actions: Dict[str, Callable[[], None]] = {
            "confirm": self.confirm, "reject": self.reject, "reopen": self.reopen, "previous": self.previous,
            "next": self.next, "undo": self.undo,
        }  # fmt: skip
        for name, act in actions.items():
            button = self.panel.buttons[name]
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)  # keys stay with the dock
            button.clicked.connect(lambda _=False, act=act: act())
        keys: Dict[str, Callable[[], None]] = {
            "C": self.confirm, "R": self.reject, "O": self.reopen, "N": self.next, "P": self.previous, "Right": self.next,
            "Left": self.previous, "Z": self.undo, "Ctrl+Z": self.undo, "M": self._edit_remark, "H": self._toggle_outlines,
            "+": lambda: self._zoomed(_ZOOM), "-": lambda: self._zoomed(1 / _ZOOM), "F5": self.reload_wanted.emit,
            **{key: (lambda key=key: self._key_kind(key)) for key in ("1", "2", "3", "4", "5", "6", "7", "8", "9", "J", "D")},
        }  # fmt: skip
        for key, act in keys.items():
            shortcut = QShortcut(QKeySequence(key), self.widget())
            shortcut.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
            shortcut.activated.connect(act)
        for box in (self.filters.survey, self.filters.order, self.filters.kinds, self.panel.kind):
            self.own_keys.keep(box)
        leave = QShortcut(QKeySequence("Escape"), self.panel.remark)
        leave.setContext(Qt.ShortcutContext.WidgetShortcut)
        leave.activated.connect(self._leave_remark)

    def _leave_remark(self) -> None:
        facts = self.session.facts if self.session is not None else None
        self.panel.remark.setText((facts["remark"] or "") if facts is not None else "")
        self.take_keys()
